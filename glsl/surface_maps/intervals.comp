#version 460
#include "lib/prelude.glsl"
#include "surface_maps/depth_interval.glsl"
#include "surface_maps/pixel_ray.glsl"

// One thread per pixel of the cube maps of a chunk: which depths answer every query right, from the first surface to
// the second.                                                                                    [Ritschel2008 3.2]
// reads map_normals[place_count], hits, second_hits [chunk_count * 6 * resolution^2]
// writes intervals (low | high << 16) of the same length   shared none
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

void main()
{
    uint i = linear_index();
    uint pixel_count = 6 * params.resolution * params.resolution;
    if (i >= params.chunk_count * pixel_count) return;

    uint place = params.first_place + i / pixel_count;
    vec3 direction;
    if (!map_pixel_ray(i % pixel_count, params.resolution, map_normals[place], direction)) {
        intervals[i] = ANY_DEPTH;
        return;
    }
    intervals[i] = depth_interval(hits[i], second_hits[i], params.codes_per_metre, params.bias * 2.0 / float(params.resolution));
}
