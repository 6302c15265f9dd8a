#version 460
#include "lib/prelude.glsl"
#include "lib/cluster_basis.glsl"
#include "lib/element.glsl"
#include "lib/leaf_light.glsl"

// One thread per element at a vertex: what the vectors of the leaves around it say of its irradiance, mean by area.
// reads element_vertices[element_count], positions, normals [vertex_count], triangles, incident_offsets[vertex_count + 1],
//       incident_triangles, leaves, triangle_leaves, direct_vectors, indirect_vectors (per leaf and function), neighbours (rows of leaves)
// writes direct_irradiance, indirect_irradiance [element_count] (W/m2)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer ElementVertices { uint element_vertices[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Normals { vec3 normals[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 4, scalar) readonly buffer IncidentOffsets { uint incident_offsets[]; };
layout(set = 0, binding = 5, scalar) readonly buffer IncidentTriangles { uint incident_triangles[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Leaves { LeafElement leaves[]; };
layout(set = 0, binding = 7, scalar) readonly buffer TriangleLeaves { uvec2 triangle_leaves[]; };
layout(set = 0, binding = 8, scalar) readonly buffer DirectVectors { SharedVectors direct_vectors[]; };
layout(set = 0, binding = 9, scalar) readonly buffer IndirectVectors { SharedVectors indirect_vectors[]; };
layout(set = 0, binding = 10, scalar) writeonly buffer DirectIrradiance { vec3 direct_irradiance[]; };
layout(set = 0, binding = 11, scalar) writeonly buffer IndirectIrradiance { vec3 indirect_irradiance[]; };
layout(set = 0, binding = 12, scalar) readonly buffer NeighbourOffsets { uint neighbour_offsets[]; };  // per leaf, and one more
layout(set = 0, binding = 13, scalar) readonly buffer Neighbours { uint neighbours[]; };
layout(constant_id = 0) const uint IRRADIANCE_FUNCTIONS = 3u;
layout(push_constant, scalar) uniform Params {
    uint element_count;
    float unit;     // of vectors, W/m2
    float reach;    // of a leaf's light over its border, in its shorter half sides
} params;

LeafElement leaf_element(uint leaf) { return leaves[leaf]; }
uvec2 leaf_row(uint leaf) { return params.reach > 0.0 ? uvec2(neighbour_offsets[leaf], neighbour_offsets[leaf + 1]) : uvec2(0); }
uint leaf_neighbour(uint index) { return neighbours[index]; }

void leaf_vectors(uint leaf, vec2 uv, out mat3 direct, out mat3 indirect)
{
    direct = indirect = mat3(0.0);
    for (uint k = 0; k < IRRADIANCE_FUNCTIONS; ++k) {
        float b = basis(k, uv);
        direct += b * unpacked(direct_vectors[leaf * IRRADIANCE_FUNCTIONS + k], params.unit);
        indirect += b * unpacked(indirect_vectors[leaf * IRRADIANCE_FUNCTIONS + k], params.unit);
    }
}

void main()
{
    uint element = linear_index();
    if (element >= params.element_count) return;

    uint entry = element_vertices[element];
    uint vertex = vertex_of(entry);
    float side = side_of(entry);
    vec3 position = positions[vertex], normal = side * normals[vertex];
    vec3 direct = vec3(0.0), indirect = vec3(0.0);
    float area_sum = 0.0;
    for (uint k = incident_offsets[vertex]; k < incident_offsets[vertex + 1]; ++k) {
        uint triangle = incident_triangles[k];
        uvec2 sides = triangle_leaves[triangle];
        uint leaf = side < 0.0 ? sides.y : sides.x;
        if (leaf == NO_LEAF) continue;
        uvec3 v = triangles[triangle];
        float area = length(cross(positions[v.y] - positions[v.x], positions[v.z] - positions[v.x]));
        mat3 d, i;
        light_on_leaf(leaf, position, params.reach, d, i);
        direct += area * max(normal * d, 0.0);
        indirect += area * max(normal * i, 0.0);
        area_sum += area;
    }
    float inverse = area_sum > 0.0 ? 1.0 / area_sum : 0.0;
    direct_irradiance[element] = inverse * direct;
    indirect_irradiance[element] = inverse * indirect;
}
