#ifndef TRANSFERS
#define TRANSFERS
// What one link carries from its sender to its receiver: a list of (receiver's bin, sender's bin, weight).
// The kernel binds nodes, leaves, cosine_norms[leaf_count], bin_directions[bin_count], spread_offsets, spread and
// params.bins (BinParams), and defines the bridge, called once per entry of the list:
//     void transfer(uint receiver, uint receiver_bin, uint sender, uint sender_bin, float weight)
// The weight turns the sender's exitant intensity per area into the receiver's incident radiance: it is the share of the
// bin that the sender covers.                                                        [Dachsbacher2007 Eqs. 15 to 17]
// Differs from [Dachsbacher2007]: at leaves, and nodes within a flat surface, the cosines of the actual direction stand in for those of the bin, bins lie on
// the side of the surface that the direction lies on, and a sender is read in each bin that it covers, not in one (its own
// "accurate CPU implementation"): a flat one by samples of its rectangle, a large or uneven one by a cone. Nothing then
// passes from one bin into another, and the footprints of a surface's parts tile as the parts do, so that what the surface
// lets through and what it takes away cancel bin by bin.
#include "lib/direction_bins.glsl"
#include "lib/hierarchy.glsl"

void transfer(uint receiver, uint receiver_bin, uint sender, uint sender_bin, float weight);

const float FOUR_PI = 12.5663706143592;

const uint SAMPLES_A_SIDE = 4;              // of a footprint, at most
const float MOST_SAMPLED = 4.0;             // bins: larger footprints are cones

// An end of a link. Nodes within one flat surface have a normal like a leaf.
struct End {
    bool is_flat;
    vec3 normal;
    float norm;
};

End end_of(HierarchyNode node)
{
    if (node.shape == NONE) return End(false, vec3(0.0), 0.0);
    return End(true, leaves[node.shape].normal, cosine_norms[node.shape]);
}

// Of a disc, seen from straight above, of that area over squared distance: never more than half of the sphere.
float disc_solid_angle(float area)
{
    float ratio = area / (0.25 * FOUR_PI);
    return 0.5 * FOUR_PI * (ratio / (sqrt(1.0 + ratio) * (sqrt(1.0 + ratio) + 1.0)));
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
    v = bin_directions[middle];
    if (is_between(p, q, v, p_cos, q_cos)) return middle;
    // Nearest of all is the bin itself.
    uint last = spread_offsets[middle + 1];
    for (uint k = spread_offsets[middle] + 1; k < last; ++k) {
        v = bin_directions[spread[k].bin];
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

// A flat sender's rectangle, sample by sample: footprints that tile a surface tile the bins.
void sampled(uint sender, uint receiver, HierarchyNode from, HierarchyNode to, End q, End p, bool passes_behind, float coverage)
{
    uint side = clamp(uint(ceil(2.0 * sqrt(coverage))), 1u, SAMPLES_A_SIDE), found = 0;
    uint bins[SAMPLES_A_SIDE * SAMPLES_A_SIDE];
    vec2 weights[SAMPLES_A_SIDE * SAMPLES_A_SIDE];      // and what is covered, in bins
    for (uint s = 0; s < side * side; ++s) {
        vec2 at = (vec2(s % side, s / side) + 0.5) / float(side) * 2.0 - 1.0;
        vec3 offset = to.center - from.center - at.x * from.half_u - at.y * from.half_v;
        float squared = dot(offset, offset);
        if (!(squared > 0.0)) continue;
        vec3 w = offset / sqrt(squared);
        if (passes_behind && dot(p.normal, w) >= 0.0) continue;
        vec3 v;
        uint bin = bin_between(p, q, w, v);
        if (bin == NONE) continue;
        float solid_angle = disc_solid_angle(from.area / float(side * side) * abs(dot(q.normal, w)) / squared);
        float covered = solid_angle * float(params.bins.count) / FOUR_PI;
        uint k = 0;
        while (k < found && bins[k] != bin) ++k;
        if (k == found) {
            bins[found] = bin;
            weights[found++] = vec2(0.0);
        }
        weights[k] += vec2(weight_between(p, q, w, v, covered), covered);
    }
    // No bin is covered more than once: what is let through is then never more than what came.
    for (uint k = 0; k < found; ++k) transfer(receiver, bins[k], sender, bins[k], weights[k].x / max(weights[k].y, 1.0));
}

void transfers_of(uint sender, uint receiver)
{
    HierarchyNode from = nodes[sender], to = nodes[receiver];
    vec3 offset = to.center - from.center;
    float squared = dot(offset, offset);
    if (!(squared > 0.0) || from.area <= 0.0) return;
    vec3 w = offset / sqrt(squared);
    End q = end_of(from), p = end_of(to);
    bool passes_behind = p.is_flat && (leaves[to.shape].flags & BLOCKS_BEHIND) == 0;
    float q_cos = dot(q.normal, w);
    float solid_angle = q.is_flat ? disc_solid_angle(from.area * abs(q_cos) / squared) : from.area / squared;
    if (!(solid_angle > 0.0)) return;
    // All of the sender lies behind a surface that nothing reaches from there.
    if (passes_behind && q.is_flat
        && dot(p.normal, offset) >= abs(dot(p.normal, from.half_u)) + abs(dot(p.normal, from.half_v))) return;
    float coverage = solid_angle * float(params.bins.count) / FOUR_PI;

    bool is_cone = params.bins.class_count > 0 && params.bins.is_gaussian == 0;
    if (is_cone && q.is_flat && coverage <= MOST_SAMPLED) {
        sampled(sender, receiver, from, to, q, p, passes_behind, coverage);
        return;
    }
    // The class above, so that no bin is covered more than once and nothing is cut off.
    float doublings = log2(coverage);
    uint size_class = doublings < 0.25 ? 0u : min(uint(ceil(2.0 * doublings)), params.bins.class_count);
    uint middle = bin_of(w, params.bins.side);
    if (size_class == 0) {
        vec3 v;
        uint bin = bin_between(p, q, w, v);
        if (bin == NONE || (passes_behind && dot(p.normal, w) >= 0.0)) return;
        transfer(receiver, bin, sender, bin, weight_between(p, q, w, v, coverage));
        return;
    }

    uint list = size_class * params.bins.count + middle;
    uint first = spread_offsets[list], last = spread_offsets[list + 1];
    float total = 0.0;
    // The bin that a Gaussian reads: the nearest one on the sender's side.
    uint read_bin = NONE;
    for (uint k = first; k < last; ++k) {
        if (q.is_flat && dot(q.normal, bin_directions[spread[k].bin]) * q_cos <= 0.0) continue;
        if (read_bin == NONE) read_bin = spread[k].bin;
        total += spread[k].weight;
    }
    if (!(total > 0.0)) return;
    for (uint k = first; k < last; ++k) {
        uint bin = spread[k].bin;
        vec3 v = bin_directions[bin];
        if ((q.is_flat && dot(q.normal, v) * q_cos <= 0.0) || (passes_behind && dot(p.normal, v) >= 0.0)) continue;
        float weight = coverage * spread[k].weight / total;
        if (params.bins.is_gaussian == 0) {
            read_bin = bin;
            if (q.is_flat) weight = min(weight, 1.0);
        }
        if (q.is_flat) weight /= discrete_cosine(dot(q.normal, bin_directions[read_bin]), q.norm, params.bins.count);
        transfer(receiver, bin, sender, read_bin, weight);
    }
}
#endif
