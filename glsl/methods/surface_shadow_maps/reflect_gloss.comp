#version 460
#include "lib/prelude.glsl"
#include "lib/atlas.glsl"
#include "lib/hemisphere_bins.glsl"
#include "lib/shared_exponent.glsl"
#include "lib/specular_albedo.glsl"
#include "lib/brdf.glsl"

// One thread per (shiny texel, bin): radiance that its specular lobe sends along the bin, of what arrived along all bins: the
// lobe's albedo times the mean of what arrives within it, so that few bins neither make nor lose light. In the texel's own
// axes. No lobe is narrower than a bin.
// reads glossy_texels[row_count], gloss[texel_count], arrived[row_count * side * side] (W/m2)
// writes sent, updates sent_sum [row_count * side * side] (W m^-2 sr^-1, shared exponents)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer GlossyTexels { uint glossy_texels[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Gloss { TexelGloss gloss[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Arrived { vec3 arrived[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Sent { uint sent[]; };
layout(set = 0, binding = 4, scalar) buffer SentSum { uint sent_sum[]; };
layout(push_constant, scalar) uniform Params { uint row_count; uint side; } params;

void main()
{
    uint bin_count = params.side * params.side, i = linear_index();
    if (i >= params.row_count * bin_count) return;

    uint row = i / bin_count;
    TexelGloss g = gloss[glossy_texels[row]];
    float alpha = max(g.alpha, 0.6 / float(params.side));
    Surface s = Surface(vec3(0.0), g.f0, g.f90, alpha, vec3(0.0), vec3(0.0, 0.0, 1.0), true);
    vec3 along = bin_middle(i % bin_count, params.side), sum = vec3(0.0), weights = vec3(0.0);
    for (uint bin = 0; bin < bin_count; ++bin) {
        vec3 towards = bin_middle(bin, params.side), weight = brdf_value(s, along, towards);
        sum += weight * arrived[row * bin_count + bin];
        weights += weight * (bin_cosine(bin, params.side) * bin_solid_angle(params.side));
    }
    vec3 radiance = specular_albedo(s, along.z) * sum / max(weights, vec3(1e-20));
    sent[i] = encode_32(radiance);
    sent_sum[i] = encode_32(decode_32(sent_sum[i]) + radiance);
}
