#version 460
#include "lib/prelude.glsl"

// One thread per pixel: all light but the punctual one, by the splats that reached it, divided by their weights; where none
// did, interpolated between vertices.                                                      [Dachsbacher2007 4.3, third pass]
// reads the G-buffer, direct_splats, indirect_splats (W/m2 times weight, weight), triangles, positions, direct_irradiance
//       and indirect_irradiance [element_count] (W/m2), back_elements[vertex_count]   updates direct, indirect [pixel_count]   shared none
layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0) uniform usampler2D visible_triangles;
layout(set = 0, binding = 1) uniform sampler2D g_position;
layout(set = 0, binding = 2) uniform sampler2D g_normal;
layout(set = 0, binding = 3) uniform sampler2D g_albedo;
layout(set = 0, binding = 4) uniform sampler2D g_specular;
layout(set = 0, binding = 5) uniform sampler2D g_emission;
layout(set = 0, binding = 6, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Positions { vec3 positions[]; };
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
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = textureSize(visible_triangles, 0);
    if (any(greaterThanEqual(pixel, size))) return;
    uint seen = texelFetch(visible_triangles, pixel, 0).x;
    vec4 emitted = texelFetch(g_emission, pixel, 0);
    if (seen == 0 || emitted.w <= 0.5) return;

    SeenPixel p = seen_pixel(pixel, seen);
    uint index = uint(pixel.y) * uint(size.x) + uint(pixel.x);
    vec4 of_direct = texelFetch(direct_splats, pixel, 0), of_indirect = texelFetch(indirect_splats, pixel, 0);
    if (of_direct.w > 0.0) {
        direct[index] += p.reflectance * of_direct.rgb / of_direct.w;
        indirect[index] += p.reflectance * of_indirect.rgb / of_direct.w;
        return;
    }
    direct[index] += p.reflectance * INTERPOLATED(direct_irradiance, p);
    indirect[index] += p.reflectance * INTERPOLATED(indirect_irradiance, p);
}
