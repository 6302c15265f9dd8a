#ifndef VERTEX_LIGHT
#define VERTEX_LIGHT
// What a pixel shows of light per element.
// The kernel binds back_elements, and has params.weight.
#include "display/seen.glsl"
#include "lib/element.glsl"
#include "lib/specular_albedo.glsl"

// A pixel that light is added to.
struct ElementPixel {
    uvec3 elements;     // of the corners of the triangle
    vec3 weights;       // of the three
    vec3 reflectance;   // radiance per irradiance, by the pixel's sample, 1/sr
};

ElementPixel element_pixel(Seen seen)
{
    uvec3 elements = seen.vertices;
    if (seen.is_back) {
        uvec3 backs = uvec3(back_elements[elements.x], back_elements[elements.y], back_elements[elements.z]);
        if (backs.x != NO_ELEMENT) elements = backs;
    }
    // Interpolated irradiance reflects as if it came evenly from all sides, the specular lobe included.
    vec3 reflectance = params.weight * even_albedo(seen.surface, dot(seen.surface.normal, seen.to_eye)) / PI;
    return ElementPixel(elements, seen.weights, reflectance);
}

#define INTERPOLATED(values, p) (p.weights.x * values[p.elements.x] + p.weights.y * values[p.elements.y] + p.weights.z * values[p.elements.z])
#endif
