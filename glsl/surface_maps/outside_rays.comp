#version 460
#include "lib/prelude.glsl"
#include "lib/outside_map.glsl"
#include "lib/ray.glsl"

// One thread per pixel of the outside maps of a chunk and end: a ray through the object's ball along the map's direction,
// from before it and, in the second half, from behind it.                                        [Ritschel2008 3.1]
// writes rays[2 * chunk_count * resolution^2]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) writeonly buffer Rays { Ray rays[]; };
layout(push_constant, scalar) uniform Params {
    vec3 centre;            // of the object's ball, metres
    float radius;
    uint first_direction;
    uint chunk_count;
    uint directions;        // a side of a face of the cube of directions
    uint resolution;
} params;

void main()
{
    uint i = linear_index();
    uint pixels = params.resolution * params.resolution, count = params.chunk_count * pixels;
    if (i >= 2 * count) return;

    bool is_behind = i >= count;
    uint k = is_behind ? i - count : i;
    mat3 frame = outside_frame(params.first_direction + k / pixels, params.directions);
    vec2 at = (vec2(k % params.resolution, k % pixels / params.resolution) + 0.5) * (2.0 / float(params.resolution)) - 1.0;
    float s = is_behind ? -1.0 : 1.0;
    vec3 start = params.radius * (at.x * frame[0] + at.y * frame[1] - s * OUTSIDE_REACH * frame[2]);
    rays[i] = Ray(params.centre + start, 0.0, s * frame[2], 2.0 * OUTSIDE_REACH * params.radius);
}
