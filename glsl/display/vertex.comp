#version 460
#include "lib/prelude.glsl"
#include "lib/brdf.glsl"
#include "lib/element.glsl"
#include "lib/specular_albedo.glsl"

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

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = textureSize(visible_triangles, 0);
    if (any(greaterThanEqual(pixel, size))) return;
    uint seen = texelFetch(visible_triangles, pixel, 0).x;
    vec4 emitted = texelFetch(g_emission, pixel, 0);
    if (seen == 0 || (emitted.w <= 0.5 && params.shows_colors == 0)) return;

    vec4 position = texelFetch(g_position, pixel, 0), n = texelFetch(g_normal, pixel, 0);
    vec4 diffuse = texelFetch(g_albedo, pixel, 0), specular = texelFetch(g_specular, pixel, 0);
    vec3 to_eye = params.eye.w == 0.0 ? params.eye.xyz : normalize(params.eye.xyz - position.xyz);
    Surface s = Surface(diffuse.rgb, specular.rgb, diffuse.w, n.w, emitted.rgb, n.xyz, true);

    uvec3 elements = triangles[seen - 1];
    vec3 a = positions[elements.x], b = positions[elements.y], c = positions[elements.z];
    if (dot(cross(b - a, c - a), to_eye) < 0.0) {
        uvec3 backs = uvec3(back_elements[elements.x], back_elements[elements.y], back_elements[elements.z]);
        if (backs.x != NO_ELEMENT) elements = backs;
    }

    // Interpolated irradiance reflects as if it came evenly from all sides, the specular lobe included.
    vec3 w = vec3(1.0 - position.w - specular.w, position.w, specular.w);
    uint index = uint(pixel.y) * uint(size.x) + uint(pixel.x);
    if (params.shows_colors != 0) {
        uint nearest = w.x >= max(w.y, w.z) ? elements.x : w.y >= w.z ? elements.y : elements.z;
        direct[index] += params.weight * direct_irradiance[nearest];
        return;
    }
    vec3 reflectance = params.weight * (s.albedo + specular_albedo(s, dot(s.normal, to_eye))) / PI;
    direct[index] += reflectance * (w.x * direct_irradiance[elements.x] + w.y * direct_irradiance[elements.y] + w.z * direct_irradiance[elements.z]);
    indirect[index] += reflectance * (w.x * indirect_irradiance[elements.x] + w.y * indirect_irradiance[elements.y] + w.z * indirect_irradiance[elements.z]);
}
