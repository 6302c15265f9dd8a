#version 460
#include "lib/prelude.glsl"
#include "lib/outside_map.glsl"
#include "lib/ray.glsl"

// One thread per pixel of the outside maps of a chunk: any depth from the object's first surface to its last tells both
// what lies before the object and what lies behind it.                                           [Ritschel2008 3.1]
// reads hits[2 * pixel_count] (from before, then from behind)   writes intervals (low | high << 16) [pixel_count]
// shared none.  Differs from [Ritschel2008]: theirs end at the second surface; both ends of a way are outside here.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Hits { Hit hits[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Intervals { uint intervals[]; };
layout(push_constant, scalar) uniform Params { uint pixel_count; float radius; } params;

void main()
{
    uint i = linear_index();
    if (i >= params.pixel_count) return;
    if (!is_hit(hits[i])) {
        intervals[i] = OUTSIDE_FREE | OUTSIDE_FREE << 16;
        return;
    }
    float first = outside_code(hits[i].t / params.radius - OUTSIDE_REACH);
    Hit behind = hits[params.pixel_count + i];
    float last = is_hit(behind) ? outside_code(OUTSIDE_REACH - behind.t / params.radius) : first;
    float low = ceil(first), high = floor(last);
    if (high < low) low = high = floor(0.5 * (first + last) + 0.5);
    intervals[i] = uint(low) | uint(high) << 16;
}
