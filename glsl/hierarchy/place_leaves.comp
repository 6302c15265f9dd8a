#version 460
#include "lib/prelude.glsl"
#include "lib/hierarchy.glsl"
#include "lib/unit.glsl"

// One thread per leaf: centre, vector area and extent of its vertex's cell, a third of each triangle around.
// reads positions, normals [vertex_count] (m, unit), triangles, incident_offsets[vertex_count + 1], incident_triangles
// updates leaves[leaf_count], nodes (of leaves)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Normals { vec3 normals[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 3, scalar) readonly buffer IncidentOffsets { uint incident_offsets[]; };
layout(set = 0, binding = 4, scalar) readonly buffer IncidentTriangles { uint incident_triangles[]; };
layout(set = 0, binding = 5, scalar) buffer Leaves { HierarchyLeaf leaves[]; };
layout(set = 0, binding = 6, scalar) buffer Nodes { HierarchyNode nodes[]; };
layout(push_constant, scalar) uniform Params { uint leaf_count; } params;

void main()
{
    uint leaf = linear_index();
    if (leaf >= params.leaf_count) return;

    uint vertex = leaves[leaf].element;
    vec3 own = positions[vertex];
    vec3 vector_area = vec3(0.0), offset_sum = vec3(0.0);
    float area_sum = 0.0;
    for (uint k = incident_offsets[vertex]; k < incident_offsets[vertex + 1]; ++k) {
        uvec3 v = triangles[incident_triangles[k]];
        vec3 a = positions[v.x], b = positions[v.y], c = positions[v.z];
        vec3 third = cross(b - a, c - a) / 6.0;
        float area = length(third);
        // The vertex's third of a triangle has its centre at weights (22, 7, 7) / 36.
        offset_sum += area * (7.0 / 36.0) * ((a - own) + (b - own) + (c - own));
        vector_area += third;
        area_sum += area;
    }
    vec3 center = area_sum > 0.0 ? own + offset_sum / area_sum : own;
    float radius = distance(center, own);
    for (uint k = incident_offsets[vertex]; k < incident_offsets[vertex + 1]; ++k) {
        uvec3 v = triangles[incident_triangles[k]];
        vec3 a = positions[v.x], b = positions[v.y], c = positions[v.z];
        radius = max(radius, distance(center, (a + b + c) / 3.0));
        radius = max(radius, distance(center, 0.5 * (own + a)));
        radius = max(radius, distance(center, 0.5 * (own + b)));
        radius = max(radius, distance(center, 0.5 * (own + c)));
    }

    leaves[leaf].normal = unit_or(vector_area, normals[vertex]);
    leaves[leaf].area = length(vector_area);
    uint node = leaves[leaf].node;
    nodes[node].center = center;
    nodes[node].radius = radius;
    nodes[node].area = length(vector_area);
}
