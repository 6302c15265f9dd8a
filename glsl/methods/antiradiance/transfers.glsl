#ifndef TRANSFERS
#define TRANSFERS
// What one link carries from its sender to its receiver: a list of (receiver's bin, sender's bin, weight).
// The kernel binds nodes, leaves, cosine_norms[leaf_count], bin_directions[bin_count], spread_offsets, spread and
// params.bins (BinParams), and defines the bridge, called once per entry of the list:
//     void transfer(uint receiver, uint receiver_bin, uint sender, uint sender_bin, float weight)
// The weight turns the sender's exitant intensity per area into the receiver's incident radiance: it is the share of the
// bin that the sender covers.                                                        [Dachsbacher2007 Eqs. 15 to 17]
// Differs from [Dachsbacher2007]: at leaves, and nodes within a flat surface, the cosines of the actual direction stand in for those of the bin, bins lie on
// the side of the surface that the direction lies on, and a sender larger than a bin is read in each bin that it covers,
// not in one (its own "accurate CPU implementation"). Nothing then passes from one bin into another, so that what a
// surface lets through and takes away cancel bin by bin, and no chain of near surfaces can grow.
#include "lib/direction_bins.glsl"
#include "lib/hierarchy.glsl"

void transfer(uint receiver, uint receiver_bin, uint sender, uint sender_bin, float weight);

const float FOUR_PI = 12.5663706143592;

void transfers_of(uint sender, uint receiver)
{
    HierarchyNode q = nodes[sender], p = nodes[receiver];
    vec3 offset = p.center - q.center;
    float squared = dot(offset, offset);
    if (!(squared > 0.0) || q.area <= 0.0) return;
    vec3 w = offset / sqrt(squared);

    // Nodes within one flat surface have a normal like a leaf.
    bool p_is_flat = p.shape != NONE, q_is_flat = q.shape != NONE;
    vec3 p_normal = vec3(0.0), q_normal = vec3(0.0);
    float p_cos = 0.0, q_cos = 0.0, p_norm = 0.0, q_norm = 0.0;
    bool passes_behind = false;
    if (p_is_flat) {
        p_normal = leaves[p.shape].normal;
        p_norm = cosine_norms[p.shape];
        p_cos = dot(p_normal, w);
        passes_behind = (leaves[p.shape].flags & BLOCKS_BEHIND) == 0;
    }
    float bin_solid_angle = FOUR_PI / float(params.bins.count), solid_angle = q.area / squared;
    if (q_is_flat) {
        q_normal = leaves[q.shape].normal;
        q_norm = cosine_norms[q.shape];
        q_cos = dot(q_normal, w);
        // Of a disc of the projected area, seen from straight above: never more than half of the sphere.
        float ratio = q.area * abs(q_cos) / (0.5 * FOUR_PI * 0.5 * squared);
        solid_angle = 0.5 * FOUR_PI * (ratio / (sqrt(1.0 + ratio) * (sqrt(1.0 + ratio) + 1.0)));
    }
    if (!(solid_angle > 0.0)) return;
    float coverage = solid_angle / bin_solid_angle;

    uint middle = bin_of(w, params.bins.side);
    // The class above, so that no bin is covered more than once and nothing is cut off.
    float doublings = log2(coverage);
    uint size_class = doublings < 0.25 ? 0u : min(uint(ceil(2.0 * doublings)), params.bins.class_count);
    if (!q_is_flat || size_class == 0) {
        if (passes_behind && p_cos >= 0.0) return;
        uint first = spread_offsets[middle], last = spread_offsets[middle + 1];
        for (uint k = first; k < last; ++k) {
            uint bin = spread[k].bin;
            vec3 v = bin_directions[bin];
            float p_bin = dot(p_normal, v), q_bin = dot(q_normal, v);
            if (p_is_flat && p_bin * p_cos <= 0.0) continue;
            if (q_is_flat && q_bin * q_cos <= 0.0) continue;
            float weight = coverage;
            if (p_is_flat) weight *= abs(p_cos) / discrete_cosine(p_bin, p_norm, params.bins.count);
            if (q_is_flat) weight /= discrete_cosine(q_bin, q_norm, params.bins.count);
            transfer(receiver, bin, sender, bin, weight);
            return;
        }
        return;
    }

    uint list = size_class * params.bins.count + middle;
    uint first = spread_offsets[list], last = spread_offsets[list + 1];
    float total = 0.0;
    for (uint k = first; k < last; ++k)
        if (dot(q_normal, bin_directions[spread[k].bin]) * q_cos > 0.0) total += spread[k].weight;
    if (!(total > 0.0)) return;

    // The bin that a Gaussian reads: the nearest one on the sender's side.
    uint read_bin = spread[first].bin;
    for (uint k = last; k-- > first;)
        if (dot(q_normal, bin_directions[spread[k].bin]) * q_cos > 0.0) read_bin = spread[k].bin;
    for (uint k = first; k < last; ++k) {
        uint bin = spread[k].bin;
        vec3 v = bin_directions[bin];
        if (dot(q_normal, v) * q_cos <= 0.0 || (passes_behind && dot(p_normal, v) >= 0.0)) continue;
        float weight = coverage * spread[k].weight / total;
        if (params.bins.is_gaussian == 0) {
            read_bin = bin;
            weight = min(weight, 1.0);
        }
        weight /= discrete_cosine(dot(q_normal, bin_directions[read_bin]), q_norm, params.bins.count);
        transfer(receiver, bin, sender, read_bin, weight);
    }
}
#endif
