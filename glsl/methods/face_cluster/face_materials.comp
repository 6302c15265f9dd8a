#version 460
#extension GL_EXT_nonuniform_qualifier : require
#include "lib/prelude.glsl"
#include "lib/material.glsl"
#include "lib/texture_region.glsl"

// One thread per triangle: mean albedo, reflectance (specular included, seen along the normal) and emission, from four
// places of it.
// reads triangles, triangle_materials, positions, attributes, materials   writes albedo and reflectance (1), emission (W m^-2 sr^-1)
// shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 1, scalar) readonly buffer TriangleMaterials { uint triangle_materials[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Attributes { VertexAttributes attributes[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Materials { Material materials[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer Albedo { vec3 albedo[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer Reflectance { vec3 reflectance[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer Emission { vec3 emission[]; };
layout(set = 1, binding = 0) uniform sampler2D textures[];
layout(push_constant, scalar) uniform Params { uint triangle_count; } params;

vec4 sample_texture(TextureSlot slot, vec2 uv)
{
    ivec2 size = textureSize(textures[nonuniformEXT(slot.texture)], 0);
    return textureLod(textures[nonuniformEXT(slot.texture)], uv, region_level(slot, size));
}

void main()
{
    uint t = linear_index();
    if (t >= params.triangle_count) return;
    uvec3 v = triangles[t];
    VertexAttributes p = attributes[v.x], q = attributes[v.y], r = attributes[v.z];
    set_region(p, q, r, 1.0 / 4.0);
    Material m = materials[triangle_materials[t]];
    // Centres of the four like triangles that the middles of its sides make of it.
    vec3 places[4] = vec3[4](vec3(4, 1, 1) / 6.0, vec3(1, 4, 1) / 6.0, vec3(1, 1, 4) / 6.0, vec3(2, 2, 2) / 6.0);
    vec3 albedo_sum = vec3(0.0), specular_sum = vec3(0.0), emission_sum = vec3(0.0);
    bool is_lit = (m.flags & UNLIT) == 0;
    for (uint k = 0; k < 4; ++k) {
        VertexAttributes at = interpolated(p, q, r, places[k]);
        Surface s = surface_of(m, at, vec3(0, 0, 1), vec4(1, 0, 0, 1), false);
        albedo_sum += s.reflects ? s.albedo : vec3(0.0);
        specular_sum += s.reflects ? s.f0 : vec3(0.0);
        if (is_lit) emission_sum += emission_of(m, at);
    }
    albedo[t] = albedo_sum / 4.0;
    reflectance[t] = min((albedo_sum + specular_sum) / 4.0, vec3(1.0));
    emission[t] = emission_sum / 4.0;
}
