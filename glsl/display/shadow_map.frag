#version 460
#extension GL_EXT_nonuniform_qualifier : require
#include "lib/prelude.glsl"
#include "lib/material.glsl"

// One fragment of a shadow map: holes of alpha masks let light through; back faces block it like front faces.
// reads triangle_materials, materials, textures   writes the depth image   shared none
layout(set = 0, binding = 4, scalar) readonly buffer TriangleMaterials { uint triangle_materials[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Materials { Material materials[]; };
layout(set = 1, binding = 0) uniform sampler2D textures[];

layout(location = 0) in vec2 in_uv0;
layout(location = 1) in vec2 in_uv1;
layout(location = 2) in vec4 in_color;
layout(location = 3) flat in uint in_triangle;

vec4 sample_texture(TextureSlot slot, vec2 uv) { return textureLod(textures[nonuniformEXT(slot.texture)], uv, 0.0); }

void main()
{
    uint material = triangle_materials[in_triangle];
    if (materials[material].alpha_cutoff < 0.0) return;
    if (is_hole_of(materials[material], VertexAttributes(in_uv0, in_uv1, in_color))) discard;
}
