#ifndef TRACE_HOLES
#define TRACE_HOLES
// Bindings 3 to 6 and set 1 of every kernel of this folder, and what they are for: whether a ray passes a triangle
// through a hole of its alpha mask. Opaque scenes are traced with ALPHA_TEST off and pay nothing.
#include "lib/material.glsl"

layout(constant_id = 0) const bool ALPHA_TEST = false;
layout(set = 0, binding = 3, scalar) readonly buffer SceneTriangles    { uvec3 triangles[]; };             // triangle_count
layout(set = 0, binding = 4, scalar) readonly buffer TriangleMaterials { uint triangle_materials[]; };     // triangle_count
layout(set = 0, binding = 5, scalar) readonly buffer Attributes        { VertexAttributes attributes[]; }; // vertex_count
layout(set = 0, binding = 6, scalar) readonly buffer Materials         { Material materials[]; };          // material_count
layout(set = 1, binding = 0) uniform sampler2D textures[];

vec4 sample_texture(TextureSlot slot, vec2 uv)
{
    return textureLod(textures[nonuniformEXT(slot.texture)], uv, 0.0);
}

bool is_hole(uint triangle, vec2 barycentrics)
{
    if (ALPHA_TEST) {
        Material material = materials[triangle_materials[triangle]];
        if (material.alpha_cutoff < 0.0) return false;
        uvec3 v = triangles[triangle];
        vec3 weights = vec3(1.0 - barycentrics.x - barycentrics.y, barycentrics);
        VertexAttributes a = attributes[v.x], b = attributes[v.y], c = attributes[v.z];
        return is_hole_of(material, VertexAttributes(mat3x2(a.uv0, b.uv0, c.uv0) * weights,
                                                     mat3x2(a.uv1, b.uv1, c.uv1) * weights,
                                                     mat3x4(a.color, b.color, c.color) * weights));
    }
    return false;
}

bool is_lit_side(uint triangle, bool is_back)
{
    uint flags = materials[triangle_materials[triangle]].flags;
    return (flags & UNLIT) == 0 && (!is_back || (flags & DOUBLE_SIDED) != 0);
}
#endif
