#ifndef VERTEX_LIGHT
#define VERTEX_LIGHT
// What a pixel shows of light per element.
// The kernel binds visible_triangles, g_position, g_normal, g_albedo, g_specular, g_emission, triangles, positions,
// back_elements, and has params.eye and params.weight.
#include "lib/brdf.glsl"
#include "lib/element.glsl"
#include "lib/specular_albedo.glsl"

// A pixel that light is added to.
struct SeenPixel {
    uvec3 elements;     // of the corners of the triangle
    vec3 weights;       // of the three
    vec3 reflectance;   // radiance per irradiance, by the pixel's sample, 1/sr
};

SeenPixel seen_pixel(ivec2 pixel, uint seen)
{
    vec4 position = texelFetch(g_position, pixel, 0), n = texelFetch(g_normal, pixel, 0);
    vec4 diffuse = texelFetch(g_albedo, pixel, 0), specular = texelFetch(g_specular, pixel, 0);
    vec3 to_eye = params.eye.w == 0.0 ? params.eye.xyz : normalize(params.eye.xyz - position.xyz);
    Surface s = Surface(diffuse.rgb, specular.rgb, diffuse.w, n.w, texelFetch(g_emission, pixel, 0).rgb, n.xyz, true);

    SeenPixel result;
    result.elements = triangles[seen - 1];
    vec3 a = positions[result.elements.x], b = positions[result.elements.y], c = positions[result.elements.z];
    if (dot(cross(b - a, c - a), to_eye) < 0.0) {
        uvec3 e = result.elements, backs = uvec3(back_elements[e.x], back_elements[e.y], back_elements[e.z]);
        if (backs.x != NO_ELEMENT) result.elements = backs;
    }
    result.weights = vec3(1.0 - position.w - specular.w, position.w, specular.w);
    // Interpolated irradiance reflects as if it came evenly from all sides, the specular lobe included.
    result.reflectance = params.weight * (s.albedo + specular_albedo(s, dot(s.normal, to_eye))) / PI;
    return result;
}

#define INTERPOLATED(values, p) (p.weights.x * values[p.elements.x] + p.weights.y * values[p.elements.y] + p.weights.z * values[p.elements.z])
#endif
