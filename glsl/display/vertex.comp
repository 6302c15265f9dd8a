#version 460
#include "lib/prelude.glsl"

// One thread per pixel: all light but the punctual one, interpolated between the vertices' irradiance.
// reads the G-buffer, triangles, positions, direct_irradiance and indirect_irradiance [element_count] (W/m2),
//       back_elements[vertex_count]   updates direct, indirect [pixel_count]   shared none
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
// eye: position and 1, or the direction to an orthographic eye and 0; weight: of this sample of the pixel.
layout(push_constant, scalar) uniform Params {
    vec4 eye;
    float weight;
    uint shows_colors;  // direct_irradiance holds colours, shown unlit: each pixel that of the vertex it is nearest to
} params;

#include "display/vertex_light.glsl"

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = textureSize(visible_triangles, 0);
    if (any(greaterThanEqual(pixel, size))) return;
    uint seen = texelFetch(visible_triangles, pixel, 0).x;
    vec4 emitted = texelFetch(g_emission, pixel, 0);
    if (seen == 0 || (emitted.w <= 0.5 && params.shows_colors == 0)) return;

    SeenPixel p = seen_pixel(pixel, seen);
    uint index = uint(pixel.y) * uint(size.x) + uint(pixel.x);
    if (params.shows_colors != 0) {
        vec3 w = p.weights;
        uint nearest = w.x >= max(w.y, w.z) ? p.elements.x : w.y >= w.z ? p.elements.y : p.elements.z;
        direct[index] += params.weight * direct_irradiance[nearest];
        return;
    }
    direct[index] += p.reflectance * INTERPOLATED(direct_irradiance, p);
    indirect[index] += p.reflectance * INTERPOLATED(indirect_irradiance, p);
}
