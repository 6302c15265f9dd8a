#version 460
#include "lib/prelude.glsl"
#include "display/seen.glsl"

// One thread per pixel: all light but the punctual one, interpolated between the vertices' irradiance.
// reads the G-buffer, triangles, positions, direct_irradiance and indirect_irradiance [element_count] (W/m2),
//       back_elements[vertex_count]   updates direct, indirect [pixel_count]   shared none
layout(set = 0, binding = 8, scalar) readonly buffer DirectIrradiance { vec3 direct_irradiance[]; };
layout(set = 0, binding = 9, scalar) readonly buffer IndirectIrradiance { vec3 indirect_irradiance[]; };
layout(set = 0, binding = 10, scalar) readonly buffer BackElements { uint back_elements[]; };
layout(set = 0, binding = 11, scalar) buffer Direct { vec3 direct[]; };
layout(set = 0, binding = 12, scalar) buffer Indirect { vec3 indirect[]; };
// eye: position and 1, or the direction to an orthographic eye and 0; weight: of this sample of the pixel.
layout(push_constant, scalar) uniform Params {
    vec4 eye;
    float weight;
    uint shows_colors;  // direct_irradiance holds colours, shown unlit: each pixel that of the vertex it is nearest to
} params;

#include "display/vertex_light.glsl"

void main()
{
    ivec2 pixel;
    uint index;
    if (!is_in_picture(pixel, index)) return;
    Seen seen;
    if (!is_seen(pixel, params.eye, seen) || (!seen.surface.reflects && params.shows_colors == 0)) return;

    ElementPixel p = element_pixel(seen);
    if (params.shows_colors != 0) {
        vec3 w = p.weights;
        uint nearest = w.x >= max(w.y, w.z) ? p.elements.x : w.y >= w.z ? p.elements.y : p.elements.z;
        direct[index] += params.weight * direct_irradiance[nearest];
        return;
    }
    direct[index] += p.reflectance * INTERPOLATED(direct_irradiance, p);
    indirect[index] += p.reflectance * INTERPOLATED(indirect_irradiance, p);
}
