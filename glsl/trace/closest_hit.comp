#version 460
#extension GL_EXT_nonuniform_qualifier : require
#include "lib/prelude.glsl"
#include "lib/ray.glsl"
#include "lib/bvh.glsl"
#include "trace/holes.glsl"

// One thread per ray: the closest hit
// reads bvh_nodes, bvh_triangles, rays[ray_count], the tables of trace/holes   writes hits[ray_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform usamplerBuffer bvh_nodes;     // NODE_TEXELS each
layout(set = 0, binding = 1) uniform usamplerBuffer bvh_triangles; // TRIANGLE_TEXELS each, in leaf order
layout(set = 0, binding = 2, scalar) readonly buffer Rays        { Ray rays[]; };                  // ray_count
layout(set = 0, binding = 7, scalar) writeonly buffer Hits       { Hit hits[]; };                    // ray_count
layout(push_constant, scalar) uniform Params { uint ray_count; } params;

uvec4 bvh_node_texel(uint i) { return texelFetch(bvh_nodes, int(i)); }
uvec4 bvh_triangle_texel(uint i) { return texelFetch(bvh_triangles, int(i)); }

void main()
{
    uint i = linear_index();
    if (i >= params.ray_count) return;
    hits[i] = traverse(rays[i], false);
}
