#version 460
#include "lib/prelude.glsl"
#include "lib/bins.glsl"
#include "lib/hemisphere.glsl"

// One thread per leaf: where it receives, and how its bins are turned.                             [Dong2007 5.1]
// reads leaf_elements[leaf_count], ray_origins, element_normals [element_count], element_vertices, positions,
// triangles, incident_offsets, incident_triangles   writes receivers[leaf_count]   shared none
// Differs from [Dong2007]: bins may turn with the surface (their axis the normal, their side towards a neighbour), so
// that what a leaf sees does not change as its object turns.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer LeafElements { uint leaf_elements[]; };
layout(set = 0, binding = 1, scalar) readonly buffer RayOrigins { vec3 ray_origins[]; };
layout(set = 0, binding = 2, scalar) readonly buffer ElementNormals { vec3 element_normals[]; };
layout(set = 0, binding = 3, scalar) readonly buffer ElementVertices { uint element_vertices[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 6, scalar) readonly buffer IncidentOffsets { uint incident_offsets[]; };
layout(set = 0, binding = 7, scalar) readonly buffer IncidentTriangles { uint incident_triangles[]; };
layout(set = 0, binding = 8, scalar) writeonly buffer Receivers { Receiver receivers[]; };
layout(push_constant, scalar) uniform Params {
    uint leaf_count;
    uint follows_surface;   // 0: all bins along the world's axes
    float spin;             // radians about the first axis of the bins, for jitter from frame to frame
} params;

#include "lib/element.glsl"

// The unit quaternion of a rotation matrix.
vec4 quaternion_of(mat3 m)
{
    vec4 q;
    float trace = m[0][0] + m[1][1] + m[2][2];
    if (trace > 0.0) {
        q = vec4(m[1][2] - m[2][1], m[2][0] - m[0][2], m[0][1] - m[1][0], 1.0 + trace);
    } else if (m[0][0] >= m[1][1] && m[0][0] >= m[2][2]) {
        q = vec4(1.0 + m[0][0] - m[1][1] - m[2][2], m[0][1] + m[1][0], m[0][2] + m[2][0], m[1][2] - m[2][1]);
    } else if (m[1][1] >= m[2][2]) {
        q = vec4(m[0][1] + m[1][0], 1.0 + m[1][1] - m[0][0] - m[2][2], m[1][2] + m[2][1], m[2][0] - m[0][2]);
    } else {
        q = vec4(m[0][2] + m[2][0], m[1][2] + m[2][1], 1.0 + m[2][2] - m[0][0] - m[1][1], m[0][1] - m[1][0]);
    }
    return q / length(q);
}

void main()
{
    uint leaf = linear_index();
    if (leaf >= params.leaf_count) return;
    uint element = leaf_elements[leaf];
    Receiver r;
    r.origin = ray_origins[element];
    r.normal = element_normals[element];

    mat3 frame = mat3(1.0);
    if (params.follows_surface != 0) {
        uint vertex = vertex_of(element_vertices[element]);
        frame = basis_of(r.normal);
        if (incident_offsets[vertex] < incident_offsets[vertex + 1]) {
            uvec3 v = triangles[incident_triangles[incident_offsets[vertex]]];
            vec3 side = positions[v.x == vertex ? v.y : v.x] - positions[vertex];
            side -= dot(side, r.normal) * r.normal;
            float squared = dot(side, side);
            if (squared > 0.0) frame = mat3(side / sqrt(squared), cross(r.normal, side) / sqrt(squared), r.normal);
        }
    }
    float c = cos(params.spin), s = sin(params.spin);
    // About an axis that is no axis of the cube, so that all of its faces move.
    vec3 axis = vec3(0.267261242, 0.534522484, 0.801783726);
    mat3 spin = c * mat3(1.0) + (1.0 - c) * outerProduct(axis, axis)
                + s * mat3(0.0, axis.z, -axis.y, -axis.z, 0.0, axis.x, axis.y, -axis.x, 0.0);
    r.frame = quaternion_of(frame * spin);
    receivers[leaf] = r;
}
