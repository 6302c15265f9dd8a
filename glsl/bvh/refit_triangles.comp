#version 460
#include "lib/prelude.glsl"
#include "lib/bvh.glsl"

// One thread per triangle: moves its corners to where the vertices are.
// reads slot_vertices[triangle_count], positions (m)   updates bvh_triangles[triangle_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer SlotVertices { uvec3 slot_vertices[]; };       // triangle_count
layout(set = 0, binding = 1, scalar) readonly buffer Positions    { vec3 positions[]; };            // vertex_count
layout(set = 0, binding = 2, scalar) buffer Triangles             { BvhTriangle bvh_triangles[]; }; // triangle_count
layout(push_constant, scalar) uniform Params { uint triangle_count; } params;

void main()
{
    uint slot = linear_index();
    if (slot >= params.triangle_count) return;
    uvec3 vertices = slot_vertices[slot];
    bvh_triangles[slot].corners[0] = positions[vertices.x];
    bvh_triangles[slot].corners[1] = positions[vertices.y];
    bvh_triangles[slot].corners[2] = positions[vertices.z];
}
