#version 460
#extension GL_EXT_nonuniform_qualifier : require
#include "lib/prelude.glsl"
#include "lib/ray.glsl"
#include "lib/bvh.glsl"
#include "trace/holes.glsl"

// One thread per ray: the closest hit
// reads bvh_nodes, bvh_triangles, rays[ray_count], the tables of trace/holes   writes hits[ray_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Nodes       { BvhNode bvh_nodes[]; };         // node_count
layout(set = 0, binding = 1, scalar) readonly buffer Triangles   { BvhTriangle bvh_triangles[]; }; // triangle_count
layout(set = 0, binding = 2, scalar) readonly buffer Rays        { Ray rays[]; };                  // ray_count
layout(set = 0, binding = 7, scalar) writeonly buffer Hits       { Hit hits[]; };                    // ray_count
layout(push_constant, scalar) uniform Params { uint ray_count; } params;

BvhNode bvh_node(uint node) { return bvh_nodes[node]; }
BvhTriangle bvh_triangle(uint slot) { return bvh_triangles[slot]; }

void main()
{
    uint i = linear_index();
    if (i >= params.ray_count) return;
    hits[i] = traverse(rays[i], false);
}
