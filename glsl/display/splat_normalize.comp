#version 460
#include "lib/prelude.glsl"
#include "display/seen.glsl"

// One thread per pixel: all light but the punctual one, by the splats that reached it, divided by their weights; where none
// did, interpolated between vertices.                                                      [Dachsbacher2007 4.3, third pass]
// reads the G-buffer, direct_splats, indirect_splats (W/m2 times weight, weight), triangles, positions, direct_irradiance
//       and indirect_irradiance [element_count] (W/m2), back_elements[vertex_count]   updates direct, indirect [pixel_count]   shared none
layout(set = 0, binding = 8, scalar) readonly buffer DirectIrradiance { vec3 direct_irradiance[]; };
layout(set = 0, binding = 9, scalar) readonly buffer IndirectIrradiance { vec3 indirect_irradiance[]; };
layout(set = 0, binding = 10, scalar) readonly buffer BackElements { uint back_elements[]; };
layout(set = 0, binding = 11, scalar) buffer Direct { vec3 direct[]; };
layout(set = 0, binding = 12, scalar) buffer Indirect { vec3 indirect[]; };
layout(set = 0, binding = 13) uniform sampler2D direct_splats;
layout(set = 0, binding = 14) uniform sampler2D indirect_splats;
// eye: position and 1, or the direction to an orthographic eye and 0; weight: of this sample of the pixel.
layout(push_constant, scalar) uniform Params { vec4 eye; float weight; } params;

#include "display/vertex_light.glsl"

void main()
{
    ivec2 pixel;
    uint index;
    if (!is_in_picture(pixel, index)) return;
    Seen seen;
    if (!is_seen(pixel, params.eye, seen) || !seen.surface.reflects) return;

    ElementPixel p = element_pixel(seen);
    vec4 of_direct = texelFetch(direct_splats, pixel, 0), of_indirect = texelFetch(indirect_splats, pixel, 0);
    if (of_direct.w > 0.0) {
        direct[index] += p.reflectance * of_direct.rgb / of_direct.w;
        indirect[index] += p.reflectance * of_indirect.rgb / of_direct.w;
        return;
    }
    direct[index] += p.reflectance * INTERPOLATED(direct_irradiance, p);
    indirect[index] += p.reflectance * INTERPOLATED(indirect_irradiance, p);
}
