#ifndef LIB_LIGHT
#define LIB_LIGHT
// Punctual lights of KHR_lights_punctual: what arrives at a point, unoccluded.
#include "lib/scene.glsl"

// Irradiance on a plane facing the light at `point` (W/m2), with the unit direction and distance towards the light.
vec3 light_irradiance(Light light, vec3 point, out vec3 to_light, out float distance_to_light)
{
    if (light.kind == LIGHT_DIRECTIONAL) {
        to_light = -light.direction;
        distance_to_light = 1e30;
        return light.intensity;
    }
    vec3 offset = light.position - point;
    float squared = max(dot(offset, offset), 1e-12);
    distance_to_light = sqrt(squared);
    to_light = offset / distance_to_light;

    float falloff = 1.0;
    if (light.range > 0.0) {
        // KHR_lights_punctual: max(min(1 - (d / range)^4, 1), 0) / d^2
        float ratio = distance_to_light / light.range;
        falloff = clamp(1.0 - ratio * ratio * ratio * ratio, 0.0, 1.0);
    }
    if (light.kind == LIGHT_SPOT) {
        float cone = clamp(dot(light.direction, -to_light) * light.spot_scale + light.spot_offset, 0.0, 1.0);
        falloff *= cone * cone;
    }
    return light.intensity * (falloff / squared);
}
#endif
