#version 460
#include "lib/prelude.glsl"
#include "lib/element.glsl"
#include "lib/surfel.glsl"

// One thread per leaf: the surfel of its element, from the third of each triangle around that belongs to it.   [Dong2007 4.1]
// reads leaf_elements[leaf_count], element_vertices, element_normals [element_count], positions, triangles,
// incident_offsets[vertex_count + 1], incident_triangles, back_elements[vertex_count]
// writes surfels, moments [leaf_count ..], leaf_cells[leaf_count], corner_texels[CORNER_TEXELS * (1 +
// incident_triangles)]   shared none
// Differs from [Dong2007]: an ellipse about the middle of the vertex's cell instead of a disc about the vertex, so that
// cells on edges and long cells cover no more than is there, and all of it.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer LeafElements { uint leaf_elements[]; };
layout(set = 0, binding = 1, scalar) readonly buffer ElementVertices { uint element_vertices[]; };
layout(set = 0, binding = 2, scalar) readonly buffer ElementNormals { vec3 element_normals[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 5, scalar) readonly buffer IncidentOffsets { uint incident_offsets[]; };
layout(set = 0, binding = 6, scalar) readonly buffer IncidentTriangles { uint incident_triangles[]; };
layout(set = 0, binding = 7, scalar) writeonly buffer Surfels { Surfel surfels[]; };
layout(set = 0, binding = 8, scalar) writeonly buffer Moments { SurfelMoments moments[]; };
layout(set = 0, binding = 9, scalar) readonly buffer BackElements { uint back_elements[]; };
layout(set = 0, binding = 10, scalar) writeonly buffer LeafCells { LeafCell leaf_cells[]; };
layout(set = 0, binding = 11, scalar) writeonly buffer CornerTexels { uvec4 corner_texels[]; };
layout(push_constant, scalar) uniform Params { uint leaf_count; } params;

// Of barycentric coordinates' gradients: beyond all bounds.
const float NOWHERE = 1e20;

void main()
{
    uint leaf = linear_index();
    if (leaf >= params.leaf_count) return;

    uint element = leaf_elements[leaf], entry = element_vertices[element];
    uint vertex = vertex_of(entry);
    uint first = incident_offsets[vertex], last = incident_offsets[vertex + 1];
    vec3 origin = positions[vertex];
    bool is_back = side_of(entry) < 0.0;
    leaf_cells[leaf] = LeafCell(origin, first, last - first,
                                (is_back ? CELL_OF_BACK : 0u) | (back_elements[vertex] != NO_ELEMENT ? CELL_HAS_OTHER_SIDE : 0u));

    // Sums over the cell with the vertex as origin. A corner's third of a triangle is a quadrangle: the corner, the
    // middles of its two edges, the centroid; cut in two along the line from the corner, each half a sixth.
    vec3 first_moment = vec3(0.0), diagonal = vec3(0.0), mixed = vec3(0.0), across_sum = vec3(0.0);
    float area = 0.0;
    for (uint k = first; k < last; ++k) {
        uvec3 v = triangles[incident_triangles[k]];
        vec3 a = positions[v.x], b = positions[v.y], c = positions[v.z];
        vec3 across = cross(b - a, c - a);
        float sixth = 0.5 * length(across) / 6.0;
        vec3 p = v.x == vertex ? b : v.y == vertex ? c : a, q = v.x == vertex ? c : v.y == vertex ? a : b;
        p -= origin;
        q -= origin;
        vec3 centre = (p + q) / 3.0;
        for (uint half_index = 0; half_index < 2; ++half_index) {
            vec3 middle = 0.5 * (half_index == 0 ? p : q), sum = middle + centre;
            first_moment += sixth * sum / 3.0;
            diagonal += sixth / 12.0 * (middle * middle + centre * centre + sum * sum);
            mixed += sixth / 12.0 * (middle * middle.yzx + centre * centre.yzx + sum * sum.yzx);
        }
        area += 2.0 * sixth;
        across_sum += across / 6.0;
    }

    Surfel s;
    SurfelMoments m;
    vec3 mean = area > 0.0 ? first_moment / area : vec3(0.0);
    m.diagonal = area > 0.0 ? max(diagonal / area - mean * mean, vec3(0.0)) : vec3(0.0);
    m.mixed = area > 0.0 ? mixed / area - mean * mean.yzx : vec3(0.0);
    m.across = side_of(entry) * across_sum;
    float length_across = length(m.across);
    s.centre = origin + mean;
    s.normal = length_across > 0.0 ? m.across / length_across : element_normals[element];
    s.area = area;
    // The element's own normal is what its light is computed with: it belongs to the cone.
    s.cos_cone = clamp(dot(s.normal, element_normals[element]), -1.0, 1.0);
    s.radius = s.thickness = 0.0;
    for (uint k = first; k < last; ++k) {
        uvec3 v = triangles[incident_triangles[k]];
        vec3 a = positions[v.x], b = positions[v.y], c = positions[v.z];
        vec3 p = (v.x == vertex ? b : v.y == vertex ? c : a) - origin;
        vec3 q = (v.x == vertex ? c : v.y == vertex ? a : b) - origin;
        vec3 corners[4] = vec3[4](vec3(0.0), 0.5 * p, 0.5 * q, (p + q) / 3.0);
        for (uint i = 0; i < 4; ++i) {
            s.radius = max(s.radius, length(corners[i] - mean));
            s.thickness = max(s.thickness, abs(dot(corners[i] - mean, s.normal)));
        }
        vec3 across = side_of(entry) * cross(b - a, c - a);
        float squared = dot(across, across);
        if (squared > 0.0) s.cos_cone = min(s.cos_cone, dot(s.normal, across) / sqrt(squared));
    }
    shape_surfel(m, s);
    // Exactly so large that the ellipse holds all corners of the cell: with less, light leaks between surfels.
    float farthest = 0.0;
    for (uint k = first; k < last; ++k) {
        uvec3 v = triangles[incident_triangles[k]];
        vec3 a = positions[v.x], b = positions[v.y], c = positions[v.z];
        vec3 p = (v.x == vertex ? b : v.y == vertex ? c : a) - origin;
        vec3 q = (v.x == vertex ? c : v.y == vertex ? a : b) - origin;
        vec3 corners[4] = vec3[4](vec3(0.0), 0.5 * p, 0.5 * q, (p + q) / 3.0);
        for (uint i = 0; i < 4; ++i) {
            float along = dot(s.g1, corners[i] - mean), across = dot(s.g2, corners[i] - mean);
            farthest = max(farthest, along * along + across * across);
        }
    }
    float scale = farthest > 0.0 ? 0.99 / sqrt(farthest) : 1.0;
    s.g1 *= scale;
    s.g2 *= scale;
    surfels[leaf] = s;
    moments[leaf] = m;
    if (leaf == 0) {
        for (uint k = 0; k < CORNER_TEXELS; ++k) corner_texels[k] = floatBitsToUint(vec4(NOWHERE));
    }
    // Both leaves of a vertex have the same.
    if (is_back) return;
    vec3 axes[2] = half_axes(s);
    for (uint k = first; k < last; ++k) {
        uvec3 v = triangles[incident_triangles[k]];
        vec3 p = positions[v.x == vertex ? v.y : v.y == vertex ? v.z : v.x] - origin;
        vec3 q = positions[v.x == vertex ? v.z : v.y == vertex ? v.x : v.y] - origin;
        vec3 normal = cross(p, q);
        float squared = dot(normal, normal);
        // Without area no place is in it.
        vec3 along_p = squared > 0.0 ? cross(q, normal) / squared : vec3(NOWHERE);
        vec3 along_q = squared > 0.0 ? cross(normal, p) / squared : vec3(NOWHERE);
        vec4 both = vec4(dot(along_p, axes[0]), dot(along_p, axes[1]), dot(along_q, axes[0]), dot(along_q, axes[1]));
        uint to = CORNER_TEXELS * (k + 1);
        corner_texels[to] = uvec4(floatBitsToUint(along_p), 0);
        corner_texels[to + 1] = uvec4(floatBitsToUint(along_q), 0);
        corner_texels[to + 2] = floatBitsToUint(squared > 0.0 ? both : vec4(NOWHERE));
    }
}
