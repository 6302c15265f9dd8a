#version 460
#extension GL_EXT_nonuniform_qualifier : require
#include "lib/prelude.glsl"
#include "lib/hierarchy.glsl"
#include "lib/leaf_gloss.glsl"
#include "lib/material.glsl"
#include "lib/texture_region.glsl"

// One thread per leaf: its specular lobe, averaged over the triangles around its vertices.
// reads leaves[leaf_count], members, triangles, triangle_materials, incident_offsets[vertex_count + 1], incident_triangles, positions,
// attributes, materials   writes gloss[leaf_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Leaves { HierarchyLeaf leaves[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 2, scalar) readonly buffer TriangleMaterials { uint triangle_materials[]; };
layout(set = 0, binding = 3, scalar) readonly buffer IncidentOffsets { uint incident_offsets[]; };
layout(set = 0, binding = 4, scalar) readonly buffer IncidentTriangles { uint incident_triangles[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Attributes { VertexAttributes attributes[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Materials { Material materials[]; };
layout(set = 0, binding = 8, scalar) writeonly buffer Gloss { LeafGloss gloss[]; };
layout(set = 0, binding = 9, scalar) readonly buffer Members { uint members[]; };
layout(set = 1, binding = 0) uniform sampler2D textures[];
layout(push_constant, scalar) uniform Params { uint leaf_count; } params;

vec4 sample_texture(TextureSlot slot, vec2 uv)
{
    ivec2 size = textureSize(textures[nonuniformEXT(slot.texture)], 0);
    return textureLod(textures[nonuniformEXT(slot.texture)], uv, region_level(slot, size));
}

void main()
{
    uint leaf = linear_index();
    if (leaf >= params.leaf_count) return;
    uint first = leaves[leaf].first_member, last = first + leaves[leaf].member_count;
    LeafGloss mean = LeafGloss(vec3(0.0), 0.0, 0.0);
    float area_sum = 0.0;
    for (uint member = first; member < last; ++member) {
        uint vertex = members[member];
        for (uint k = incident_offsets[vertex]; k < incident_offsets[vertex + 1]; ++k) {
            uint triangle = incident_triangles[k];
            uvec3 v = triangles[triangle];
            vec3 a = positions[v.x], b = positions[v.y], c = positions[v.z];
            float area = length(cross(b - a, c - a));
            vec3 w = (vec3(equal(v, uvec3(vertex))) * 15.0 + 7.0) / 36.0;
            VertexAttributes p = attributes[v.x], q = attributes[v.y], r = attributes[v.z];
            set_region(p, q, r, 1.0 / 3.0);
            VertexAttributes at = interpolated(p, q, r, w);
            Surface s = surface_of(materials[triangle_materials[triangle]], at, vec3(0.0, 0.0, 1.0), vec4(1.0, 0.0, 0.0, 1.0), false);
            if (!s.reflects) continue;
            mean.f0 += area * s.f0;
            mean.f90 += area * s.f90;
            mean.alpha += area * s.alpha;
            area_sum += area;
        }
    }
    float inverse = area_sum > 0.0 ? 1.0 / area_sum : 0.0;
    gloss[leaf] = LeafGloss(mean.f0 * inverse, mean.f90 * inverse, mean.alpha * inverse);
}
