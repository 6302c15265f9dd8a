#version 460
#include "lib/prelude.glsl"
#include "lib/atlas.glsl"

// One thread per place of the atlas: its texel as a pixel that sees it, with the specular lobe alone, so that a final gather
// over the atlas computes a glossy bounce for each texel.                                  [Ritschel2008 4.4, Fig. 17]
// reads texel_at[resolution^2], texels, parts, gloss
// writes the G-buffer of display/g_buffer.comp   shared none
layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0, scalar) readonly buffer TexelAt { uint texel_at[]; };      // NO_TEXEL where there is none
layout(set = 0, binding = 1, scalar) readonly buffer Texels { AtlasTexel texels[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Parts { AtlasPart parts[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Gloss { TexelGloss gloss[]; };
layout(set = 0, binding = 4, r32ui) writeonly uniform uimage2D visible_triangles;
layout(set = 0, binding = 5, rgba32f) writeonly uniform image2D g_position;
layout(set = 0, binding = 6, rgba32f) writeonly uniform image2D g_normal;
layout(set = 0, binding = 7, rgba32f) writeonly uniform image2D g_albedo;
layout(set = 0, binding = 8, rgba32f) writeonly uniform image2D g_specular;
layout(set = 0, binding = 9, rgba32f) writeonly uniform image2D g_emission;
// eye: position and 1, or the direction to an orthographic eye and 0.
layout(push_constant, scalar) uniform Params { vec4 eye; uint resolution; } params;

void main()
{
    uvec2 at = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(at, uvec2(params.resolution)))) return;
    uint index = texel_at[at.y * params.resolution + at.x];
    bool is_seen = index != NO_TEXEL && shows_towards(texels[index], params.eye);
    ivec2 pixel = ivec2(at);
    if (!is_seen) {
        imageStore(visible_triangles, pixel, uvec4(0));
        return;
    }
    AtlasTexel texel = texels[index];
    AtlasPart part = parts[texel.first_part];
    TexelGloss g = gloss[index];
    imageStore(visible_triangles, pixel, uvec4(part.triangle + 1));
    imageStore(g_position, pixel, vec4(texel.position, part.barycentrics.x));
    imageStore(g_normal, pixel, vec4(texel.normal, g.alpha));
    imageStore(g_albedo, pixel, vec4(0.0, 0.0, 0.0, g.f90));
    imageStore(g_specular, pixel, vec4(g.f0, part.barycentrics.y));
    imageStore(g_emission, pixel, vec4(0.0, 0.0, 0.0, 1.0));
}
