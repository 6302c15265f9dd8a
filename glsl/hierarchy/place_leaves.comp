#version 460
#include "lib/prelude.glsl"
#include "lib/hierarchy.glsl"
#include "lib/unit.glsl"

// One thread per leaf: centre, vector area and extent of its vertices' cells, a third of each triangle around; and the rectangle
// along its patch, or its shortest edge, that has the same area and whose second moments are in the same proportion.
// reads positions, normals [vertex_count] (m, unit), triangles, incident_offsets[vertex_count + 1], incident_triangles,
// members (vertices)
// updates leaves[leaf_count], nodes (of leaves)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Normals { vec3 normals[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 3, scalar) readonly buffer IncidentOffsets { uint incident_offsets[]; };
layout(set = 0, binding = 4, scalar) readonly buffer IncidentTriangles { uint incident_triangles[]; };
layout(set = 0, binding = 5, scalar) buffer Leaves { HierarchyLeaf leaves[]; };
layout(set = 0, binding = 6, scalar) buffer Nodes { HierarchyNode nodes[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Members { uint members[]; };
layout(push_constant, scalar) uniform Params { uint leaf_count; } params;

// Integral of the square of a linear function over a triangle of that area, from its values at the corners.
float second_moment(float area, float a, float b, float c) { return area / 6.0 * (a * a + b * b + c * c + a * b + b * c + c * a); }

void main()
{
    uint leaf = linear_index();
    if (leaf >= params.leaf_count) return;

    uint middle_vertex = leaves[leaf].element;
    uint first_member = leaves[leaf].first_member, last_member = first_member + leaves[leaf].member_count;
    vec3 from = positions[middle_vertex];
    vec3 vector_area = vec3(0.0), offset_sum = vec3(0.0);
    float area_sum = 0.0;
    for (uint member = first_member; member < last_member; ++member) {
        uint vertex = members[member];
        vec3 own = positions[vertex];
        for (uint k = incident_offsets[vertex]; k < incident_offsets[vertex + 1]; ++k) {
            uvec3 v = triangles[incident_triangles[k]];
            vec3 a = positions[v.x], b = positions[v.y], c = positions[v.z];
            vec3 third = cross(b - a, c - a) / 6.0;
            float area = length(third);
            // The vertex's third of a triangle has its centre at weights (22, 7, 7) / 36.
            offset_sum += area * (own - from + (7.0 / 36.0) * ((a - own) + (b - own) + (c - own)));
            vector_area += third;
            area_sum += area;
        }
    }
    vec3 center = area_sum > 0.0 ? from + offset_sum / area_sum : from;
    float radius = 0.0;
    for (uint member = first_member; member < last_member; ++member) {
        uint vertex = members[member];
        vec3 own = positions[vertex];
        radius = max(radius, distance(center, own));
        for (uint k = incident_offsets[vertex]; k < incident_offsets[vertex + 1]; ++k) {
            uvec3 v = triangles[incident_triangles[k]];
            vec3 a = positions[v.x], b = positions[v.y], c = positions[v.z];
            radius = max(radius, distance(center, (a + b + c) / 3.0));
            radius = max(radius, distance(center, 0.5 * (own + a)));
            radius = max(radius, distance(center, 0.5 * (own + b)));
            radius = max(radius, distance(center, 0.5 * (own + c)));
        }
    }

    vec3 normal = unit_or(vector_area, normals[middle_vertex]), edge = vec3(0.0);
    uvec2 patch_edge = leaves[leaf].along;
    if (patch_edge.x != NONE) {
        edge = positions[patch_edge.y] - positions[patch_edge.x];
    } else {
        float shortest = 1e30;
        for (uint k = incident_offsets[middle_vertex]; k < incident_offsets[middle_vertex + 1]; ++k) {
            uvec3 v = triangles[incident_triangles[k]];
            for (uint corner = 0; corner < 3; ++corner) {
                vec3 to = positions[v[corner]] - from;
                if (v[corner] != middle_vertex && dot(to, to) < shortest && dot(to, to) > 0.0) {
                    shortest = dot(to, to);
                    edge = to;
                }
            }
        }
    }
    vec3 along = unit_or(edge - dot(edge, normal) * normal, unit_or(cross(normal, abs(normal.x) < 0.9 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0)), vec3(1.0, 0.0, 0.0)));
    vec3 across = cross(normal, along);
    vec2 moments = vec2(0.0);
    for (uint member = first_member; member < last_member; ++member) {
        uint vertex = members[member];
        vec3 o = positions[vertex] - center;
        for (uint k = incident_offsets[vertex]; k < incident_offsets[vertex + 1]; ++k) {
            uvec3 v = triangles[incident_triangles[k]];
            vec3 a = positions[v.x], b = positions[v.y], c = positions[v.z];
            float sixth = length(cross(b - a, c - a)) / 12.0;
            vec3 middle = (a + b + c) / 3.0 - center;
            for (uint corner = 0; corner < 3; ++corner) {
                if (v[corner] == vertex) continue;
                vec3 half_way = 0.5 * (o + positions[v[corner]] - center);
                moments.x += second_moment(sixth, dot(o, along), dot(half_way, along), dot(middle, along));
                moments.y += second_moment(sixth, dot(o, across), dot(half_way, across), dot(middle, across));
            }
        }
    }
    vec2 sides = area_sum > 0.0 ? sqrt(3.0 * moments / area_sum) : vec2(0.0);
    // Of the area that the cells cover as seen along the normal: the cells of a grid are hexagons, whose rectangles are then
    // the grid's, and tile as the cells do.
    float covered = 4.0 * sides.x * sides.y;
    if (covered > 0.0) sides *= sqrt(length(vector_area) / covered);

    leaves[leaf].normal = normal;
    leaves[leaf].area = length(vector_area);
    uint node = leaves[leaf].node;
    nodes[node].center = center;
    nodes[node].radius = radius;
    nodes[node].area = length(vector_area);
    nodes[node].half_u = sides.x * along;
    nodes[node].half_v = sides.y * across;
}
