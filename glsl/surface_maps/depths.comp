#version 460
#extension GL_EXT_nonuniform_qualifier : require
#include "lib/prelude.glsl"
#include "surface_maps/both_surfaces.glsl"
#include "surface_maps/depth_interval.glsl"
#include "surface_maps/pixel_ray.glsl"
#include "trace/holes.glsl"

// One thread per pixel of the cube maps of a chunk: both surfaces along its ray by one walk of our own traversal (two where
// surfaces lie within a gap of each other), and the depths between them. What cube_rays, two closest hits, second_rays and
// intervals do, without their lists.
// Differs from [Ritschel2008]: where it is asked for, the second surface is the next one that is lit from this side, not the
// back of a thin body: only such can be asked for, and depths hold longer.
//                                                                                                [Ritschel2008 3.2]
// reads map_origins, map_normals [place_count] (m, unit), the hierarchy and what tells its holes
// writes intervals (low | high << 16) [chunk_count * 6 * resolution^2]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform usamplerBuffer bvh_nodes;     // NODE_TEXELS each
layout(set = 0, binding = 1) uniform usamplerBuffer bvh_triangles; // TRIANGLE_TEXELS each, in leaf order
layout(set = 0, binding = 2, scalar) readonly buffer MapOrigins { vec3 map_origins[]; };
layout(set = 0, binding = 7, scalar) readonly buffer MapNormals { vec3 map_normals[]; };
layout(set = 0, binding = 8, scalar) writeonly buffer Intervals { uint intervals[]; };
layout(push_constant, scalar) uniform Params {
    uint first_place;
    uint chunk_count;
    uint resolution;
    float codes_per_metre;
    float bias;             // in widths of a pixel
    float gap;              // of surfaces that count as two, m
    uint lit_only;          // behind the first, surfaces that no light of this side falls on are never asked for
} params;

uvec4 bvh_node_texel(uint i) { return texelFetch(bvh_nodes, int(i)); }
uvec4 bvh_triangle_texel(uint i) { return texelFetch(bvh_triangles, int(i)); }

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
    Hit first, second;
    traverse_both(Ray(map_origins[place], 0.0, direction, 3e38), params.lit_only != 0, params.gap, first, second);
    intervals[i] = depth_interval(first, second, params.codes_per_metre, params.bias * 2.0 / float(params.resolution));
}
