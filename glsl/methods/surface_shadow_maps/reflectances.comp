#version 460
#include "lib/prelude.glsl"
#include "lib/atlas.glsl"
#include "lib/specular_albedo.glsl"

// One thread per texel: what it reflects of even light, and the part of that which it sends on evenly: all, where it has no
// table of directions, else what its diffuse lobe reflects.
// reads albedo, gloss, glossy_rows [texel_count]   writes reflectance, sent_evenly [texel_count] (1)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Albedo { vec3 albedo[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Gloss { TexelGloss gloss[]; };
layout(set = 0, binding = 2, scalar) readonly buffer GlossyRows { uint glossy_rows[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Reflectance { vec3 reflectance[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer SentEvenly { vec3 sent_evenly[]; };
layout(push_constant, scalar) uniform Params { uint texel_count; } params;

void main()
{
    uint texel = linear_index();
    if (texel >= params.texel_count) return;
    TexelGloss g = gloss[texel];
    Surface s = Surface(albedo[texel], g.f0, g.f90, g.alpha, vec3(0.0), vec3(0.0, 0.0, 1.0), true);
    vec3 diffuse = s.albedo, specular = vec3(0.0);
    if (g.f90 > 0.0 || g.f0 != vec3(0.0)) {
        // Means over the hemisphere, by Gauss' rule for the weight 2 cos.
        const vec3 cosines = vec3(0.212340538, 0.590533136, 0.911412040), weights = vec3(0.139653958, 0.458482212, 0.401863830);
        diffuse = vec3(0.0);
        for (uint k = 0; k < 3; ++k) {
            diffuse += weights[k] * diffuse_albedo(s, cosines[k]);
            specular += weights[k] * specular_albedo(s, cosines[k]);
        }
    }
    reflectance[texel] = diffuse + specular;
    sent_evenly[texel] = glossy_rows[texel] == 0 ? diffuse + specular : diffuse;
}
