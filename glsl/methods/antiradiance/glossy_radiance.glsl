#ifndef GLOSSY_RADIANCE
#define GLOSSY_RADIANCE
// What the specular lobe of a glossy leaf sends to the eye of what arrived bin by bin.
//
// The kernel declares the constants WORDS and BIN_COUNT, and binds leaves, gloss, cosine_norms, bin_directions, and arrived
// [glossy_count * BIN_COUNT] (W m^-2 sr^-1).
#include "lib/direction_bins.glsl"
#include "lib/hierarchy.glsl"
#include "lib/specular_albedo.glsl"
#include "methods/antiradiance/glossy_surface.glsl"
#include "methods/antiradiance/table.glsl"

// Radiance reflected towards `to_eye`: the lobe's albedo times the mean of what arrives within it, so that the sum over
// few bins neither makes nor loses light.                                                        [Dachsbacher2007 Eq. 18]
vec3 glossy_radiance(uint glossy, uint leaf, vec3 to_eye)
{
    HierarchyLeaf own = leaves[leaf];
    float side = dot(own.normal, to_eye) > 0.0 ? 1.0 : -1.0;
    if (side < 0.0 && (own.flags & REFLECTS_BEHIND) == 0) return vec3(0.0);
    vec3 normal = side * own.normal;
    Surface s = glossy_surface(gloss[leaf], normal);

    vec3 sum = vec3(0.0), weights = vec3(0.0);
    for (uint bin = 0; bin < BIN_COUNT; ++bin) {
        vec3 w = BIN_DIRECTION(bin);
        float cosine = dot(normal, w);
        if (cosine > 0.0) continue;
        vec3 weight = discrete_cosine(cosine, cosine_norms[leaf], BIN_COUNT) * brdf_value(s, to_eye, -w);
        sum += weight * LOAD_ENTRY(arrived, glossy * BIN_COUNT + bin);
        weights += weight;
    }
    return max(specular_albedo(s, dot(normal, to_eye)) * sum / max(weights, vec3(1e-20)), vec3(0.0));
}
#endif
