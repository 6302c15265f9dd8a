#version 460
#include "lib/prelude.glsl"
#include "display/seen.glsl"
#include "lib/specular_albedo.glsl"
#include "lib/atlas.glsl"

// One thread per pixel: all light but the punctual one, from the atlas by a bicubic filter over the texels of the chart
// that is seen.                                                                                  [Ritschel2008 Fig. 17]
// reads the G-buffer, triangles, positions, corner_places[2 * triangle_count], texel_at[resolution^2],
//       texel_charts, texels, direct_irradiance, indirect_irradiance [texel_count] (W/m2),
//       direct_gloss, indirect_gloss [resolution^2] (W m^-2 sr^-1, towards the eye)
// updates direct, indirect [pixel_count]   shared none
layout(set = 0, binding = 8, scalar) readonly buffer CornerPlaces { TriangleCorners corner_places[]; };    // fronts, then backs
layout(set = 0, binding = 9, scalar) readonly buffer TexelAt { uint texel_at[]; };          // NO_TEXEL where there is none
layout(set = 0, binding = 10, scalar) readonly buffer TexelCharts { uint texel_charts[]; };
layout(set = 0, binding = 11, scalar) readonly buffer DirectIrradiance { vec3 direct_irradiance[]; };
layout(set = 0, binding = 12, scalar) readonly buffer IndirectIrradiance { vec3 indirect_irradiance[]; };
layout(set = 0, binding = 13, scalar) buffer Direct { vec3 direct[]; };
layout(set = 0, binding = 14, scalar) buffer Indirect { vec3 indirect[]; };
layout(set = 0, binding = 15, scalar) readonly buffer Texels { AtlasTexel texels[]; };
layout(set = 0, binding = 16, scalar) readonly buffer DirectGloss { vec3 direct_gloss[]; };
layout(set = 0, binding = 17, scalar) readonly buffer IndirectGloss { vec3 indirect_gloss[]; };
// eye: position and 1, or the direction to an orthographic eye and 0; weight: of this sample of the pixel.
layout(push_constant, scalar) uniform Params { vec4 eye; float weight; uint resolution; uint triangle_count; uint has_gloss; } params;

// Weights of the four texels around a place between the middle two: the uniform cubic B-spline.
vec4 cubic_weights(float t)
{
    float s = 1.0 - t;
    return vec4(s * s * s, 4.0 - 6.0 * t * t + 3.0 * t * t * t, 4.0 - 6.0 * s * s + 3.0 * s * s * s, t * t * t) / 6.0;
}

void main()
{
    ivec2 pixel;
    uint index;
    if (!is_in_picture(pixel, index)) return;
    Seen seen;
    if (!is_seen(pixel, params.eye, seen) || !seen.surface.reflects) return;

    TriangleCorners corners = corner_places[seen.triangle + (seen.is_back ? params.triangle_count : 0u)];
    vec3 w = seen.weights;
    vec2 place = w.x * corners.a + w.y * corners.b + w.z * corners.c;

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
    vec3 direct_shine = vec3(0.0), indirect_shine = vec3(0.0);
    float weight_sum = 0.0, shine_sum = 0.0;
    for (int y = 0; y < 4; ++y) {
        for (int x = 0; x < 4; ++x) {
            ivec2 at = first + ivec2(x, y);
            if (any(lessThan(at, ivec2(0))) || any(greaterThan(at, last))) continue;
            uint texel = texel_at[at.y * int(params.resolution) + at.x];
            if (texel == NO_TEXEL || texel_charts[texel] != chart) continue;
            float weight = wx[x] * wy[y];
            direct_sum += weight * direct_irradiance[texel];
            indirect_sum += weight * indirect_irradiance[texel];
            weight_sum += weight;
            if (params.has_gloss == 0 || !shows_towards(texels[texel], params.eye)) continue;
            direct_shine += weight * direct_gloss[at.y * int(params.resolution) + at.x];
            indirect_shine += weight * indirect_gloss[at.y * int(params.resolution) + at.x];
            shine_sum += weight;
        }
    }
    if (weight_sum <= 0.0) return;
    float cos_eye = dot(seen.surface.normal, seen.to_eye);
    vec3 albedo = params.has_gloss != 0 ? diffuse_albedo(seen.surface, cos_eye) : even_albedo(seen.surface, cos_eye);
    vec3 reflectance = params.weight / weight_sum * albedo / PI;
    float shine = shine_sum > 0.0 ? params.weight / shine_sum : 0.0;
    direct[index] += reflectance * direct_sum + shine * direct_shine;
    indirect[index] += reflectance * indirect_sum + shine * indirect_shine;
}
