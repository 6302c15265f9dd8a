#version 460
#extension GL_EXT_nonuniform_qualifier : require
#include "lib/prelude.glsl"
#include "lib/ray.glsl"
#include "lib/bvh.glsl"
#include "trace/holes.glsl"

// One thread per ray: is its whole length free?
// reads bvh_nodes, bvh_triangles, rays[ray_count], the tables of trace/holes   writes visibility[ray_count]: 1 free, 0 blocked   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Nodes       { BvhNode bvh_nodes[]; };         // node_count
layout(set = 0, binding = 1, scalar) readonly buffer Triangles   { BvhTriangle bvh_triangles[]; }; // triangle_count
layout(set = 0, binding = 2, scalar) readonly buffer Rays        { Ray rays[]; };                  // ray_count
layout(set = 0, binding = 7, scalar) writeonly buffer Visibility { uint visibility[]; };             // ray_count
layout(push_constant, scalar) uniform Params { uint ray_count; } params;

BvhNode bvh_node(uint node) { return bvh_nodes[node]; }
BvhTriangle bvh_triangle(uint slot) { return bvh_triangles[slot]; }

void main()
{
    uint i = linear_index();
    if (i >= params.ray_count) return;
    visibility[i] = is_hit(traverse(rays[i], true)) ? 0 : 1;
}
