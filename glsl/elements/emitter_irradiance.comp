#version 460
#include "lib/prelude.glsl"
#include "lib/emitter.glsl"

// One thread per element: irradiance from the emitter samples that it sees.                       [Schmitz2008 3.3, Eq. 2]
// reads element_positions, element_normals [element_count], samples[sample_count], triangles, positions,
// emission[vertex_count and on] (W m^-2 sr^-1), visible[element_count * ceil(sample_count / 32)] (bits)
// writes irradiance[element_count] (W/m2)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer ElementPositions { vec3 element_positions[]; };
layout(set = 0, binding = 1, scalar) readonly buffer ElementNormals { vec3 element_normals[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Samples { EmitterSample samples[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Emission { vec3 emission[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Visible { uint visible[]; };
layout(set = 0, binding = 7, scalar) writeonly buffer Irradiance { vec3 irradiance[]; };
layout(push_constant, scalar) uniform Params { uint element_count; uint sample_count; } params;

#include "lib/hemisphere.glsl"

void main()
{
    uint element = linear_index();
    if (element >= params.element_count) return;

    vec3 position = element_positions[element], normal = element_normals[element];
    uint words = (params.sample_count + 31) / 32;
    vec3 sum = vec3(0.0);
    for (uint k = 0; k < params.sample_count; ++k) {
        if ((visible[element * words + k / 32] >> k % 32 & 1) == 0) continue;
        EmitterSample at = samples[k];
        uvec3 v = triangles[at.triangle];
        EmitterPoint point = emitter_point(at, positions[v.x], positions[v.y], positions[v.z]);

        // The sample as a disc: without its area in the denominator, light near the emitter would have no bound.
        vec3 offset = point.position - position;
        float squared = dot(offset, offset);
        vec3 direction = squared > 0.0 ? offset / sqrt(squared) : normal;
        float cosines = max(dot(normal, direction), 0.0) * max(emitter_cosine(at, point, -direction), 0.0);
        vec3 radiance = (1.0 - at.barycentrics.x - at.barycentrics.y) * emission[v.x]
                        + at.barycentrics.x * emission[v.y] + at.barycentrics.y * emission[v.z];
        sum += radiance * (cosines * point.area / (squared + point.area / PI));
    }
    irradiance[element] = sum;
}
