#version 460
#extension GL_EXT_nonuniform_qualifier : require
#include "lib/prelude.glsl"
#include "lib/atlas.glsl"
#include "lib/material.glsl"
#include "lib/texture_region.glsl"

// One thread per texel: means over its parts of what it reflects and emits.                      [Ritschel2008 4.1]
// reads texels, parts, triangles, triangle_materials, attributes, materials, textures
// writes albedo (1), emission (W m^-2 sr^-1), gloss [texel_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Texels { AtlasTexel texels[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Parts { AtlasPart parts[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 3, scalar) readonly buffer TriangleMaterials { uint triangle_materials[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Attributes { VertexAttributes attributes[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Materials { Material materials[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 7, scalar) writeonly buffer Albedo { vec3 albedo[]; };
layout(set = 0, binding = 8, scalar) writeonly buffer Emission { vec3 emission[]; };
layout(set = 0, binding = 9, scalar) writeonly buffer Gloss { TexelGloss gloss[]; };
layout(set = 1, binding = 0) uniform sampler2D textures[];
layout(push_constant, scalar) uniform Params { uint texel_count; } params;

vec4 sample_texture(TextureSlot slot, vec2 uv)
{
    ivec2 size = textureSize(textures[nonuniformEXT(slot.texture)], 0);
    return textureLod(textures[nonuniformEXT(slot.texture)], uv, region_level(slot, size));
}

void main()
{
    uint i = linear_index();
    if (i >= params.texel_count) return;

    AtlasTexel texel = texels[i];
    vec3 albedo_sum = vec3(0.0), emission_sum = vec3(0.0), f0_sum = vec3(0.0);
    float f90_sum = 0.0, alpha_sum = 0.0, area_sum = 0.0;
    for (uint k = texel.first_part; k < texel.first_part + texel.part_count; ++k) {
        AtlasPart part = parts[k];
        uvec3 v = triangles[part.triangle];
        vec3 across = cross(positions[v.y] - positions[v.x], positions[v.z] - positions[v.x]);
        float triangle_area = 0.5 * length(across);
        VertexAttributes p = attributes[v.x], q = attributes[v.y], r = attributes[v.z];
        float share = triangle_area > 0.0 ? part.area / triangle_area : 0.0;
        set_region(p, q, r, share);

        vec3 w = vec3(1.0 - part.barycentrics.x - part.barycentrics.y, part.barycentrics);
        VertexAttributes at = interpolated(p, q, r, w);
        Material m = materials[triangle_materials[part.triangle]];
        Surface s = surface_of(m, at, texel.normal, vec4(0.0), texel.is_back != 0);
        emission_sum += part.area * s.emission;
        if (s.reflects) {
            albedo_sum += part.area * s.albedo;
            f0_sum += part.area * s.f0;
            f90_sum += part.area * s.f90;
        }
        alpha_sum += part.area * s.alpha;
        area_sum += part.area;
    }
    float inverse = area_sum > 0.0 ? 1.0 / area_sum : 0.0;
    albedo[i] = albedo_sum * inverse;
    emission[i] = emission_sum * inverse;
    gloss[i] = TexelGloss(f0_sum * inverse, f90_sum * inverse, alpha_sum * inverse);
}
