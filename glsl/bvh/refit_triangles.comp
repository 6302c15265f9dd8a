#version 460
#include "lib/prelude.glsl"
#include "lib/bvh_pack.glsl"

// One thread per triangle: its corners, where the vertices now are.
// reads bvh_slots[triangle_count], positions (m)   writes triangle_texels[TRIANGLE_TEXELS * triangle_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Slots      { BvhSlot bvh_slots[]; };     // triangle_count
layout(set = 0, binding = 1, scalar) readonly buffer Positions  { vec3 positions[]; };        // vertex_count
layout(set = 0, binding = 2, scalar) writeonly buffer Triangles { uvec4 triangle_texels[]; }; // TRIANGLE_TEXELS each
layout(push_constant, scalar) uniform Params { uint triangle_count; } params;

void main()
{
    uint i = linear_index();
    if (i >= params.triangle_count) return;
    BvhSlot slot = bvh_slots[i];
    vec3 a = positions[slot.vertices.x], b = positions[slot.vertices.y], c = positions[slot.vertices.z];
    triangle_texels[TRIANGLE_TEXELS * i] = floatBitsToUint(vec4(a, b.x));
    triangle_texels[TRIANGLE_TEXELS * i + 1] = floatBitsToUint(vec4(b.yz, c.xy));
    triangle_texels[TRIANGLE_TEXELS * i + 2] = uvec4(floatBitsToUint(c.z), slot.triangle, 0, 0);
}
