#version 460
#extension GL_EXT_nonuniform_qualifier : require
#include "lib/prelude.glsl"
#include "lib/element.glsl"
#include "lib/material.glsl"
#include "lib/texture_region.glsl"

// One thread per element: albedo and emission averaged over the triangles around its vertex, each sampled at the
// centre of the third of its area that belongs to the vertex, at the mip level of that size.
// reads element_vertices[element_count], triangles, triangle_materials, incident_offsets[vertex_count + 1],
// incident_triangles, positions, attributes, materials
// writes albedo[element_count] (1), emission[element_count] (W m^-2 sr^-1), area[element_count] (m2)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer ElementVertices { uint element_vertices[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 2, scalar) readonly buffer TriangleMaterials { uint triangle_materials[]; };
layout(set = 0, binding = 3, scalar) readonly buffer IncidentOffsets { uint incident_offsets[]; };
layout(set = 0, binding = 4, scalar) readonly buffer IncidentTriangles { uint incident_triangles[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Attributes { VertexAttributes attributes[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Materials { Material materials[]; };
layout(set = 0, binding = 8, scalar) writeonly buffer Albedo { vec3 albedo[]; };
layout(set = 0, binding = 9, scalar) writeonly buffer Emission { vec3 emission[]; };
layout(set = 0, binding = 10, scalar) writeonly buffer Area { float area[]; };
layout(set = 1, binding = 0) uniform sampler2D textures[];
layout(push_constant, scalar) uniform Params { uint element_count; } params;

vec4 sample_texture(TextureSlot slot, vec2 uv)
{
    ivec2 size = textureSize(textures[nonuniformEXT(slot.texture)], 0);
    return textureLod(textures[nonuniformEXT(slot.texture)], uv, region_level(slot, size));
}

void main()
{
    uint element = linear_index();
    if (element >= params.element_count) return;

    uint vertex = vertex_of(element_vertices[element]);
    vec3 albedo_sum = vec3(0.0), emission_sum = vec3(0.0);
    float area_sum = 0.0;
    for (uint k = incident_offsets[vertex]; k < incident_offsets[vertex + 1]; ++k) {
        uint triangle = incident_triangles[k];
        uvec3 v = triangles[triangle];
        vec3 a = positions[v.x], b = positions[v.y], c = positions[v.z];
        float third = length(cross(b - a, c - a)) / 6.0;

        // The vertex's third of a triangle has its centre at weights (22, 7, 7) / 36.
        vec3 w = (vec3(equal(v, uvec3(vertex))) * 15.0 + 7.0) / 36.0;
        VertexAttributes p = attributes[v.x], q = attributes[v.y], r = attributes[v.z];
        VertexAttributes at = interpolated(p, q, r, w);
        set_region(p, q, r, 1.0 / 3.0);

        Material m = materials[triangle_materials[triangle]];
        albedo_sum += third * albedo_of(m, at);
        emission_sum += third * emission_of(m, at);
        area_sum += third;
    }
    float inverse = area_sum > 0.0 ? 1.0 / area_sum : 0.0;
    albedo[element] = albedo_sum * inverse;
    emission[element] = emission_sum * inverse;
    area[element] = area_sum;
}
