#version 460
#include "lib/prelude.glsl"
#include "lib/element.glsl"

// One thread per element: where it is, which way it looks, and where its rays start.              [Schmitz2008 3.2]
// reads element_vertices[element_count], positions, normals [vertex_count], triangles, incident_offsets[vertex_count + 1],
// incident_triangles, open_places[element_count]   writes element_positions (m), element_normals (unit),
// ray_origins (m) [element_count]   shared none
// Differs from [Schmitz2008]: rays start a little off the vertex. Along the normal, so that they leave their own surface;
// and towards the middle of the triangles around, so that a vertex on the edge between floor and wall looks from the
// floor and sees the wall, not the plane of it from within. Those inside of other things look from a place in the open.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer ElementVertices { uint element_vertices[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Normals { vec3 normals[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 4, scalar) readonly buffer IncidentOffsets { uint incident_offsets[]; };
layout(set = 0, binding = 5, scalar) readonly buffer IncidentTriangles { uint incident_triangles[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer ElementPositions { vec3 element_positions[]; };
layout(set = 0, binding = 7, scalar) writeonly buffer ElementNormals { vec3 element_normals[]; };
layout(set = 0, binding = 8, scalar) writeonly buffer RayOrigins { vec3 ray_origins[]; };
layout(set = 0, binding = 9, scalar) readonly buffer OpenPlaces { OpenPlace open_places[]; };
layout(push_constant, scalar) uniform Params { uint element_count; float ray_offset; } params;    // ray_offset: m

// Share of the way from the vertex to the mean centroid of the triangles around it.
const float INWARD = 1.0 / 64.0;

void main()
{
    uint element = linear_index();
    if (element >= params.element_count) return;

    uint entry = element_vertices[element];
    uint vertex = vertex_of(entry);
    vec3 position = positions[vertex], normal = normals[vertex] * side_of(entry);

    // Mean offset to the centroids, in the tangent plane.
    vec3 inward = vec3(0.0);
    uint first = incident_offsets[vertex], last = incident_offsets[vertex + 1];
    for (uint k = first; k < last; ++k) {
        uvec3 v = triangles[incident_triangles[k]];
        inward += (positions[v.x] - position) + (positions[v.y] - position) + (positions[v.z] - position);
    }
    if (last > first) inward /= 3.0 * float(last - first);
    inward -= normal * dot(normal, inward);

    vec3 origin = position + INWARD * inward;
    OpenPlace open = open_places[element];
    if (open.triangle != NO_ELEMENT) {
        uvec3 v = triangles[open.triangle];
        vec3 corner = positions[v.x];
        position = corner + open.barycentrics.x * (positions[v.y] - corner) + open.barycentrics.y * (positions[v.z] - corner);
        origin = position;
    }
    element_positions[element] = position;
    element_normals[element] = normal;
    ray_origins[element] = origin + params.ray_offset * normal;
}
