#ifndef SAMPLED_LIGHT
#define SAMPLED_LIGHT
// Light of sampled emitters in a specular lobe.
// The kernel binds element_positions, samples, triangles, positions, emission and visible, and has params.sample_count.
#include "lib/brdf.glsl"
#include "lib/emitter.glsl"

// Of the lobe towards the eye, 1/sr, times the cosine towards the light.
vec3 lobe(Surface s, vec3 to_eye, vec3 to_light) { return brdf_value(s, to_eye, to_light) * max(dot(s.normal, to_light), 0.0); }

// Radiance that the lobe sends towards `to_eye`; `irradiance`: of the same light on the element, W/m2.
vec3 sampled_radiance(uint element, Surface s, vec3 to_eye, out vec3 irradiance)
{
    vec3 position = element_positions[element], sum = vec3(0.0);
    irradiance = vec3(0.0);
    uint words = (params.sample_count + 31) / 32;
    for (uint k = 0; k < params.sample_count; ++k) {
        if ((visible[element * words + k / 32] >> k % 32 & 1) == 0) continue;
        EmitterSample at = samples[k];
        uvec3 v = triangles[at.triangle];
        EmitterPoint point = emitter_point(at, positions[v.x], positions[v.y], positions[v.z]);
        // As a disc, like its diffuse light.
        vec3 offset = point.position - position;
        float squared = dot(offset, offset);
        vec3 to_light = squared > 0.0 ? offset / sqrt(squared) : s.normal;
        vec3 radiance = (1.0 - at.barycentrics.x - at.barycentrics.y) * emission[v.x]
                        + at.barycentrics.x * emission[v.y] + at.barycentrics.y * emission[v.z];
        vec3 sent = max(emitter_cosine(at, point, -to_light), 0.0) * point.area / (squared + point.area / PI) * radiance;
        sum += sent * lobe(s, to_eye, to_light);
        irradiance += sent * max(dot(s.normal, to_light), 0.0);
    }
    return sum;
}
#endif
