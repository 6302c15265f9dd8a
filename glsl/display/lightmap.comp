#version 460
#include "lib/prelude.glsl"
#include "lib/brdf.glsl"
#include "lib/specular_albedo.glsl"
#include "lib/atlas.glsl"

// One thread per pixel: all light but the punctual one, from the atlas by a bicubic filter over the texels of the chart
// that is seen.                                                                                  [Ritschel2008 Fig. 17]
// reads the G-buffer, triangles, positions, corner_places[2 * triangle_count], texel_at[resolution^2],
//       texel_charts, direct_irradiance, indirect_irradiance [texel_count] (W/m2)
// updates direct, indirect [pixel_count]   shared none
layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0) uniform usampler2D visible_triangles;
layout(set = 0, binding = 1) uniform sampler2D g_position;
layout(set = 0, binding = 2) uniform sampler2D g_normal;
layout(set = 0, binding = 3) uniform sampler2D g_albedo;
layout(set = 0, binding = 4) uniform sampler2D g_specular;
layout(set = 0, binding = 5) uniform sampler2D g_emission;
layout(set = 0, binding = 6, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 8, scalar) readonly buffer CornerPlaces { TriangleCorners corner_places[]; };    // fronts, then backs
layout(set = 0, binding = 9, scalar) readonly buffer TexelAt { uint texel_at[]; };          // NO_TEXEL where there is none
layout(set = 0, binding = 10, scalar) readonly buffer TexelCharts { uint texel_charts[]; };
layout(set = 0, binding = 11, scalar) readonly buffer DirectIrradiance { vec3 direct_irradiance[]; };
layout(set = 0, binding = 12, scalar) readonly buffer IndirectIrradiance { vec3 indirect_irradiance[]; };
layout(set = 0, binding = 13, scalar) buffer Direct { vec3 direct[]; };
layout(set = 0, binding = 14, scalar) buffer Indirect { vec3 indirect[]; };
// eye: position and 1, or the direction to an orthographic eye and 0; weight: of this sample of the pixel.
layout(push_constant, scalar) uniform Params { vec4 eye; float weight; uint resolution; uint triangle_count; } params;

const uint NO_TEXEL = 0xffffffffu;

// Weights of the four texels around a place between the middle two: the uniform cubic B-spline.
vec4 cubic_weights(float t)
{
    float s = 1.0 - t;
    return vec4(s * s * s, 4.0 - 6.0 * t * t + 3.0 * t * t * t, 4.0 - 6.0 * s * s + 3.0 * s * s * s, t * t * t) / 6.0;
}

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = textureSize(visible_triangles, 0);
    if (any(greaterThanEqual(pixel, size))) return;
    uint seen = texelFetch(visible_triangles, pixel, 0).x;
    vec4 emitted = texelFetch(g_emission, pixel, 0);
    if (seen == 0 || emitted.w <= 0.5) return;

    vec4 position = texelFetch(g_position, pixel, 0), n = texelFetch(g_normal, pixel, 0);
    vec4 diffuse = texelFetch(g_albedo, pixel, 0), specular = texelFetch(g_specular, pixel, 0);
    vec3 to_eye = params.eye.w == 0.0 ? params.eye.xyz : normalize(params.eye.xyz - position.xyz);
    Surface s = Surface(diffuse.rgb, specular.rgb, diffuse.w, n.w, emitted.rgb, n.xyz, true);
    uvec3 v = triangles[seen - 1];
    vec3 across = cross(positions[v.y] - positions[v.x], positions[v.z] - positions[v.x]);
    uint side = dot(across, to_eye) < 0.0 ? params.triangle_count : 0u;
    TriangleCorners corners = corner_places[side + seen - 1];
    vec2 place = (1.0 - position.w - specular.w) * corners.a + position.w * corners.b + specular.w * corners.c;

    // The texel under the place says which chart counts; at a border rounding may step beside it.
    ivec2 last = ivec2(int(params.resolution) - 1);
    uint chart = NO_TEXEL;
    for (int k = 0; k < 9 && chart == NO_TEXEL; ++k) {
        ivec2 beside = k == 0 ? ivec2(0) : ivec2((k - (k < 5 ? 1 : 0)) % 3 - 1, (k - (k < 5 ? 1 : 0)) / 3 - 1);
        ivec2 at = clamp(ivec2(floor(place)) + beside, ivec2(0), last);
        uint texel = texel_at[at.y * int(params.resolution) + at.x];
        if (texel != NO_TEXEL) chart = texel_charts[texel];
    }
    vec2 from = place - 0.5;
    ivec2 first = ivec2(floor(from)) - 1;
    vec4 wx = cubic_weights(fract(from.x)), wy = cubic_weights(fract(from.y));
    vec3 direct_sum = vec3(0.0), indirect_sum = vec3(0.0);
    float weight_sum = 0.0;
    for (int y = 0; y < 4; ++y) {
        for (int x = 0; x < 4; ++x) {
            ivec2 at = first + ivec2(x, y);
            if (any(lessThan(at, ivec2(0))) || any(greaterThan(at, last))) continue;
            uint texel = texel_at[at.y * int(params.resolution) + at.x];
            if (texel == NO_TEXEL || texel_charts[texel] != chart) continue;
            float w = wx[x] * wy[y];
            direct_sum += w * direct_irradiance[texel];
            indirect_sum += w * indirect_irradiance[texel];
            weight_sum += w;
        }
    }
    if (weight_sum <= 0.0) return;
    vec3 reflectance = params.weight / weight_sum * (s.albedo + specular_albedo(s, dot(s.normal, to_eye))) / PI;
    uint index = uint(pixel.y) * uint(size.x) + uint(pixel.x);
    direct[index] += reflectance * direct_sum;
    indirect[index] += reflectance * indirect_sum;
}
