#ifndef LIB_SPECULAR_ALBEDO
#define LIB_SPECULAR_ALBEDO
#include "lib/material.glsl"

// Share of even light from all sides that the specular lobe sends towards the eye: a fit in closed form of the
// directional albedo of GGX with Schlick's Fresnel term.                                             [Karis2014]
vec3 specular_albedo(Surface s, float cos_eye)
{
    const vec4 c0 = vec4(-1.0, -0.0275, -0.572, 0.022);
    const vec4 c1 = vec4(1.0, 0.0425, 1.04, -0.04);
    float roughness = sqrt(s.alpha);
    vec4 r = roughness * c0 + c1;
    float a004 = min(r.x * r.x, exp2(-9.28 * clamp(cos_eye, 0.0, 1.0))) * r.x + r.y;
    vec2 scale_bias = vec2(-1.04, 1.04) * a004 + r.zw;
    return clamp(s.f0 * scale_bias.x + s.f90 * scale_bias.y, 0.0, 1.0);
}
#endif
