#ifndef LIB_SPECULAR_ALBEDO
#define LIB_SPECULAR_ALBEDO
// What a surface reflects towards the eye of even light from all sides: the integrals of lib/brdf.glsl over the hemisphere.
#include "lib/material.glsl"

// By the specular lobe. f0 counts by one ratio of polynomials in (cos_eye, alpha) and f90 by another, fitted by least
// squares to the integral: within .05, by root mean square .009, where cos_eye is above .05.
vec3 specular_albedo(Surface s, float cos_eye)
{
    float x = clamp(cos_eye, 0.0, 1.0), y = clamp(s.alpha, 0.0, 1.0), xy = x * y;
    vec4 low = vec4(1.0, x, y, xy), high = vec4(x * x, y * y, x * xy, xy * y);
    float scale = (dot(vec4(0.025, 3.069, 8.263, -11.689), low) + dot(vec4(8.943, -4.913, -12.028, 11.896), high))
                  / (dot(vec4(1.0, 0.685, 6.973, -3.716), low) + dot(vec4(10.224, -4.316, -16.307, 17.3), high));
    float bias = (dot(vec4(0.994, -2.47, 3.751, -6.031), low) + dot(vec4(1.504, -1.604, 2.208, 1.753), high))
                 / (dot(vec4(1.0, 1.172, 19.384, -77.588), low) + dot(vec4(11.729, 69.543, 112.796, 276.166), high));
    return clamp(s.f0 * scale + s.f90 * max(bias, 0.0), 0.0, 1.0);
}

// By the diffuse lobe, which gets what the specular one lets through. The integral of (1 - eye.half)^5 cos / pi is a
// polynomial in the cosine, within 1e-4.
vec3 diffuse_albedo(Surface s, float cos_eye)
{
    float u = 1.0 - clamp(cos_eye, 0.0, 1.0);
    vec3 fresnel = s.f0 + (vec3(s.f90) - s.f0) * (u * (0.0044 + u * (0.0257 * u - 0.002)));
    return s.albedo * (1.0 - max(fresnel.r, max(fresnel.g, fresnel.b)));
}

vec3 even_albedo(Surface s, float cos_eye) { return diffuse_albedo(s, cos_eye) + specular_albedo(s, cos_eye); }
#endif
