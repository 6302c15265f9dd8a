#version 460
#extension GL_EXT_nonuniform_qualifier : require
#include "lib/prelude.glsl"
#include "lib/emissive_triangle.glsl"
#include "lib/material.glsl"
#include "lib/texture_region.glsl"

// One thread per emissive triangle: its area in the present pose and its mean emission, from a 4 x 4 pattern of places
// read at the mip level of their distance. Never zero where the factor is not: every place stays within reach.
// reads emissive_triangles[emitter_count], the scene   writes measures[emitter_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer EmissiveTriangles { uint emissive_triangles[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 2, scalar) readonly buffer TriangleMaterials { uint triangle_materials[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Attributes { VertexAttributes attributes[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Materials { Material materials[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer Measures { EmissiveMeasure measures[]; };
layout(set = 1, binding = 0) uniform sampler2D textures[];
layout(push_constant, scalar) uniform Params { uint emitter_count; } params;

vec4 sample_texture(TextureSlot slot, vec2 uv)
{
    ivec2 size = textureSize(textures[nonuniformEXT(slot.texture)], 0);
    return textureLod(textures[nonuniformEXT(slot.texture)], uv, region_level(slot, size));
}

void main()
{
    uint emitter = linear_index();
    if (emitter >= params.emitter_count) return;

    uint triangle = emissive_triangles[emitter];
    uvec3 v = triangles[triangle];
    VertexAttributes p = attributes[v.x], q = attributes[v.y], r = attributes[v.z];
    set_region(p, q, r, 1.0 / 16.0);
    Material m = materials[triangle_materials[triangle]];

    vec3 sum = vec3(0.0);
    uint places = m.emission_texture.texture == NO_TEXTURE ? 1 : 16;
    for (uint k = 0; k < places; ++k) {
        vec3 w = uniform_weights((vec2(k % 4, k / 4) + 0.5) / 4.0);
        sum += emission_of(m, interpolated(p, q, r, w));
    }
    vec3 mean = max(sum / float(places), 0.02 * m.emission);
    vec3 a = positions[v.x];
    measures[emitter].area = 0.5 * length(cross(positions[v.y] - a, positions[v.z] - a));
    measures[emitter].emission = (mean.r + mean.g + mean.b) / 3.0;
}
