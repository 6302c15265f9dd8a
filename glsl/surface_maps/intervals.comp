#version 460
#include "lib/prelude.glsl"
#include "lib/cube_map.glsl"
#include "lib/ray.glsl"

// One thread per pixel of the cube maps of a chunk: which depths answer every query right, from the first surface to
// the second.                                                                                    [Ritschel2008 3.2]
// reads map_normals[place_count], hits, second_hits [chunk_count * 6 * resolution^2]
// writes intervals (low | high << 16) of the same length   shared none
// Differs from [Ritschel2008]: the bias stands in the intervals, so that it gives way where surfaces are close; it is small,
// since queries compare along the pixel's own ray.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer MapNormals { vec3 map_normals[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Hits { Hit hits[]; };
layout(set = 0, binding = 2, scalar) readonly buffer SecondHits { Hit second_hits[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Intervals { uint intervals[]; };
layout(push_constant, scalar) uniform Params {
    uint first_place;
    uint chunk_count;
    uint resolution;
    float codes_per_metre;
    float bias;             // in widths of a pixel
} params;

const float FARTHEST = 65534.0;     // beyond every surface

void main()
{
    uint i = linear_index();
    uint pixel_count = 6 * params.resolution * params.resolution;
    if (i >= params.chunk_count * pixel_count) return;

    uint place = params.first_place + i / pixel_count;
    if (dot(cube_pixel_direction(i % pixel_count, params.resolution), map_normals[place]) <= 0.0) {
        intervals[i] = 0xffff0000u;
        return;
    }
    if (!is_hit(hits[i])) {
        intervals[i] = 0xffff0000u | uint(FARTHEST);
        return;
    }
    float first = hits[i].t * params.codes_per_metre;
    float bias = params.bias * first * (2.0 / float(params.resolution));
    float low = ceil(first + bias) + 1.0, high = 65535.0;
    if (is_hit(second_hits[i])) {
        float second = second_hits[i].t * params.codes_per_metre;
        high = floor(second - bias) - 1.0;
        if (high < low) low = high = floor(0.5 * (first + second));
    }
    low = min(low, high == 65535.0 ? FARTHEST : high);
    intervals[i] = uint(clamp(low, 0.0, FARTHEST)) | uint(clamp(high, 0.0, 65535.0)) << 16;
}
