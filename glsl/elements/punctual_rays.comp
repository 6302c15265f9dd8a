#version 460
#include "lib/prelude.glsl"
#include "lib/element.glsl"
#include "lib/light.glsl"
#include "lib/ray.glsl"

// One thread per element of a batch: shadow rays towards one punctual light, from the element and from two points on
// triangles around it, at the centres of parts of their 1:4 subdivision: the part at the vertex and the middle one.
//                                                                                                 [Schmitz2008 3.3]
// reads element_vertices, element_normals, ray_origins, shadow_offsets [element_count (+ 1)], positions, triangles,
// incident_offsets, incident_triangles, lights   writes rays[shadow_offsets of the batch] (inactive behind the horizon)
// shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer ElementVertices { uint element_vertices[]; };
layout(set = 0, binding = 1, scalar) readonly buffer ElementNormals { vec3 element_normals[]; };
layout(set = 0, binding = 2, scalar) readonly buffer RayOrigins { vec3 ray_origins[]; };
layout(set = 0, binding = 3, scalar) readonly buffer ShadowOffsets { uint shadow_offsets[]; };  // rays of the elements before
layout(set = 0, binding = 4, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 6, scalar) readonly buffer IncidentOffsets { uint incident_offsets[]; };
layout(set = 0, binding = 7, scalar) readonly buffer IncidentTriangles { uint incident_triangles[]; };
layout(set = 0, binding = 8, scalar) readonly buffer Lights { Light lights[]; };
layout(set = 0, binding = 9, scalar) writeonly buffer Rays { Ray rays[]; };
layout(push_constant, scalar) uniform Params {
    uint first_element;
    uint batch_count;
    uint light;
    float ray_offset;       // m
} params;

Ray shadow_ray(vec3 origin, vec3 normal)
{
    vec3 to_light;
    float distance_to_light;
    light_irradiance(lights[params.light], origin, to_light, distance_to_light);
    bool is_lit = dot(normal, to_light) > 0.0;
    return Ray(origin, 0.0, to_light, is_lit ? distance_to_light : -1.0);
}

void main()
{
    uint i = linear_index();
    if (i >= params.batch_count) return;

    uint element = params.first_element + i;
    uint ray = shadow_offsets[element] - shadow_offsets[params.first_element];
    uint count = shadow_offsets[element + 1] - shadow_offsets[element];
    vec3 normal = element_normals[element];
    rays[ray++] = shadow_ray(ray_origins[element], normal);

    // Of many triangles, some evenly spread.
    uint entry = element_vertices[element], vertex = vertex_of(entry);
    uint first = incident_offsets[vertex], incident = incident_offsets[vertex + 1] - first;
    uint sampled = (count - 1) / 2;
    for (uint k = 0; k < sampled; ++k) {
        uvec3 v = triangles[incident_triangles[first + k * incident / sampled]];
        vec3 own = positions[vertex];
        vec3 centre = (positions[v.x] + positions[v.y] + positions[v.z]) / 3.0;
        vec3 across = cross(positions[v.y] - positions[v.x], positions[v.z] - positions[v.x]);
        float length_squared = dot(across, across);
        vec3 face = length_squared > 0.0 ? across / sqrt(length_squared) * side_of(entry) : normal;
        rays[ray++] = shadow_ray(mix(centre, own, 0.5) + params.ray_offset * face, normal);
        rays[ray++] = shadow_ray(centre + params.ray_offset * face, normal);
    }
}
