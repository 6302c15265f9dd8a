#version 460
#include "lib/prelude.glsl"
#include "lib/emitter.glsl"
#include "lib/ray.glsl"

// One thread per (element of a batch, emitter sample): the shadow ray between them.               [Schmitz2008 3.3, area lights]
// reads element_normals, ray_origins [element_count], samples[sample_count], triangles, positions
// writes rays[batch_count * sample_count] (inactive where one of the two looks away)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer ElementNormals { vec3 element_normals[]; };
layout(set = 0, binding = 1, scalar) readonly buffer RayOrigins { vec3 ray_origins[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Samples { EmitterSample samples[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer Rays { Ray rays[]; };
layout(push_constant, scalar) uniform Params {
    uint first_element;
    uint batch_count;
    uint sample_count;
    float ray_offset;       // m
} params;

void main()
{
    uint i = linear_index();
    if (i >= params.batch_count * params.sample_count) return;

    uint element = params.first_element + i / params.sample_count;
    EmitterSample at = samples[i % params.sample_count];
    uvec3 v = triangles[at.triangle];
    EmitterPoint point = emitter_point(at, positions[v.x], positions[v.y], positions[v.z]);

    // End a little before the emitter, on the side that is seen.
    vec3 origin = ray_origins[element];
    float side = dot(point.normal, origin - point.position) < 0.0 ? -1.0 : 1.0;
    vec3 direction = point.position + point.normal * (side * params.ray_offset) - origin;
    bool is_lit = dot(element_normals[element], direction) > 0.0 && emitter_cosine(at, point, -direction) > 0.0;
    rays[i] = Ray(origin, 0.0, direction, is_lit ? 1.0 : -1.0);
}
