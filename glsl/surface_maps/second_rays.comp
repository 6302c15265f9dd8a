#version 460
#include "lib/prelude.glsl"
#include "lib/ray.glsl"

// One thread per ray: it goes on behind what it hit; none where it hit nothing.                  [Ritschel2008 3.2]
// reads hits[ray_count]   updates rays[ray_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Hits { Hit hits[]; };
layout(set = 0, binding = 1, scalar) buffer Rays { Ray rays[]; };
layout(push_constant, scalar) uniform Params { uint ray_count; float gap; } params;    // gap: m

void main()
{
    uint i = linear_index();
    if (i >= params.ray_count) return;
    if (rays[i].t_max < 0.0) return;
    if (!is_hit(hits[i])) rays[i].t_max = -1.0;
    else rays[i].t_min = hits[i].t * 1.000002 + params.gap;
}
