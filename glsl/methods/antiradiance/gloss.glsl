#ifndef GLOSS
#define GLOSS
// Specular reflection of a leaf towards a direction, from its incident bins.
// The kernel declares WORDS and BIN_COUNT, binds leaves, nodes, gloss[leaf_count], cosine_norms, bin_directions, incident,
// means, peaks, scales, has params.leaf_count, params.node_count and params.undershoot, and
// defines
//     vec3 beside(uint bin)       radiance that arrives beside what the table holds
#include "lib/direction_bins.glsl"
#include "lib/hierarchy.glsl"
#include "lib/leaf_gloss.glsl"
#include "lib/specular_albedo.glsl"
#include "methods/antiradiance/glossy_arrival.glsl"
#include "methods/antiradiance/glossy_surface.glsl"

// Radiance reflected towards `to_eye`: the lobe's albedo times the mean of what arrives within it, so that the sum over
// few bins neither makes nor loses light.                                                        [Dachsbacher2007 Eq. 18]
vec3 glossy_radiance(uint leaf, vec3 to_eye)
{
    HierarchyLeaf own = leaves[leaf];
    float side = dot(own.normal, to_eye) > 0.0 ? 1.0 : -1.0;
    if (side < 0.0 && (own.flags & REFLECTS_BEHIND) == 0) return vec3(0.0);
    vec3 normal = side * own.normal;
    Surface s = glossy_surface(gloss[leaf], normal);
    uint parent = nodes[own.node].parent;
    uint own_side = 2 * leaf + (side > 0.0 ? 0 : 1);
    vec3 mean = means[own_side];

    vec3 sum = vec3(0.0), weights = vec3(0.0);
    for (uint bin = 0; bin < BIN_COUNT; ++bin) {
        vec3 w = BIN_DIRECTION(bin, BIN_COUNT);
        float cosine = dot(normal, w);
        if (cosine > 0.0) continue;
        vec3 weight = discrete_cosine(cosine, cosine_norms[leaf], BIN_COUNT) * brdf_value(s, to_eye, -w);
        sum += weight * glossy_arrival(leaf, own.node, parent, bin, mean);
        weights += weight;
    }
    vec3 within = scales[own_side] * sum / max(weights, vec3(1e-20));
    return max(specular_albedo(s, dot(normal, to_eye)) * within, vec3(0.0));
}
#endif
