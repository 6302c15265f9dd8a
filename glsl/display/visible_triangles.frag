#version 460
#extension GL_EXT_nonuniform_qualifier : require
#include "lib/prelude.glsl"
#include "lib/material.glsl"

// One fragment: which triangle the pixel sees, as index + 1 (0 is the background); holes are looked through.
// reads triangle_materials, materials, textures   writes the triangle image, the depth image   shared none
layout(set = 0, binding = 3, scalar) readonly buffer TriangleMaterials { uint triangle_materials[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Materials { Material materials[]; };
layout(set = 1, binding = 0) uniform sampler2D textures[];

layout(location = 0) in vec2 in_uv0;
layout(location = 1) in vec2 in_uv1;
layout(location = 2) in vec4 in_color;
layout(location = 3) flat in uint in_triangle;
layout(location = 0) out uint out_triangle;

vec4 sample_texture(TextureSlot slot, vec2 uv) { return texture(textures[nonuniformEXT(slot.texture)], uv); }

void main()
{
    uint material = triangle_materials[in_triangle];
    out_triangle = in_triangle + 1;
    if (materials[material].alpha_cutoff < 0.0) return;
    if (is_hole_of(materials[material], VertexAttributes(in_uv0, in_uv1, in_color))) discard;
}
