#ifndef ENDS
#define ENDS
// The two nodes of a link, p the receiver and q the sender, and light between them.
// The kernel binds leaves, cosine_norms[leaf_count], bin_directions[bin_count], spread_offsets, spread, and has params.bins
// (BinParams).
#include "lib/direction_bins.glsl"
#include "lib/hierarchy.glsl"
#include "methods/antiradiance/solid_angle.glsl"

const float FOUR_PI = 12.5663706143592;

// An end of a link. Nodes within one flat surface have a normal like a leaf.
struct End {
    bool is_flat;
    bool passes_behind;     // nothing is received from behind
    vec3 normal;
    float norm;
};

End end_of(HierarchyNode node)
{
    if (node.shape == NONE) return End(false, false, vec3(0.0), 0.0);
    return End(true, (leaves[node.shape].flags & BLOCKS_BEHIND) == 0, leaves[node.shape].normal, cosine_norms[node.shape]);
}

// Whether light along v is on the sides of both ends that p_cos and q_cos say.
bool is_between(End p, End q, vec3 v, float p_cos, float q_cos)
{
    return !(p.is_flat && dot(p.normal, v) * p_cos <= 0.0) && !(q.is_flat && dot(q.normal, v) * q_cos <= 0.0);
}

// The bin that carries light along w, and its direction: the nearest one on the sides of both ends that w itself is on.
uint bin_between(End p, End q, vec3 w, out vec3 v)
{
    float p_cos = dot(p.normal, w), q_cos = dot(q.normal, w);
    uint middle = bin_of(w, params.bins.side);
    v = BIN_DIRECTION(middle, params.bins.count);
    if (is_between(p, q, v, p_cos, q_cos)) return middle;
    // Nearest of all is the bin itself.
    uint last = spread_offsets[middle + 1];
    for (uint k = spread_offsets[middle] + 1; k < last; ++k) {
        v = BIN_DIRECTION(spread[k].bin, params.bins.count);
        if (is_between(p, q, v, p_cos, q_cos)) return spread[k].bin;
    }
    return NONE;
}

// What `covered` bins' worth of light along w arrives as, by way of a bin along v: irradiance is that of w.
float weight_between(End p, End q, vec3 w, vec3 v, float covered)
{
    if (p.is_flat) covered *= abs(dot(p.normal, w)) / discrete_cosine(dot(p.normal, v), p.norm, params.bins.count);
    return q.is_flat ? covered / discrete_cosine(dot(q.normal, v), q.norm, params.bins.count) : covered;
}
#endif
