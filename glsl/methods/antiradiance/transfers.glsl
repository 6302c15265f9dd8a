#ifndef TRANSFERS
#define TRANSFERS
// What one link carries from its sender to its receiver: a list of (receiver's bin, sender's bin, weight).
// The kernel binds node_texels, cosine_norms[leaf_count], bin_directions[bin_count], spread_offsets, spread and
// params.bins (BinParams), and defines the bridge, the second called once per entry of the list, the first before them:
//     void transfers_follow(uint count)
//     void transfer(uint receiver, uint receiver_bin, uint sender, uint sender_bin, float weight)
// The weight turns the sender's exitant intensity per area into the receiver's incident radiance: it is the share of the
// bin that the sender covers.                                                        [Dachsbacher2007 Eqs. 15 to 17]
// Differs from [Dachsbacher2007]: at leaves, and nodes within a flat surface, the cosines of the actual direction stand in for those of the bin, bins lie on
// the side of the surface that the direction lies on, and a sender is read in each bin that it covers, not in one (its own
// "accurate CPU implementation"): a flat one by samples of its rectangle, from close by as its sides cut the bins, an uneven one by a cone. Nothing then
// passes from one bin into another, and the footprints of a surface's parts tile as the parts do, so that what the surface
// lets through and what it takes away cancel bin by bin.
#include "methods/antiradiance/ends.glsl"

void transfers_follow(uint count);
void transfer(uint receiver, uint receiver_bin, uint sender, uint sender_bin, float weight);

const uint SAMPLES_A_SIDE = 4;              // of a footprint, at most
const float MOST_SAMPLED = 4.0;             // bins: larger footprints are cut out

// A flat sender's rectangle, sample by sample: footprints that tile a surface tile the bins.
void sampled(uint sender, uint receiver, End q, End p, float coverage)
{
    uint side = clamp(uint(ceil(2.0 * sqrt(coverage))), 1u, SAMPLES_A_SIDE), count = side * side;
    // Samples side by side mostly fall into one bin, and most senders into one alone: what is summed up, and then those before.
    uint current = NONE, found = 0, sides = sides_reached(q, p, p.center - q.center);
    vec2 sum = vec2(0.0);                               // weight, and what is covered, in bins
    uint bins[SAMPLES_A_SIDE * SAMPLES_A_SIDE];
    vec2 sums[SAMPLES_A_SIDE * SAMPLES_A_SIDE];
    for (uint s = 0; s <= count; ++s) {
        uint bin = NONE;
        vec2 own = vec2(0.0);
        if (s < count) {
            vec2 at = (vec2(s % side, s / side) + 0.5) / float(side) * 2.0 - 1.0;
            vec3 offset = p.center - q.center - at.x * q.half_u - at.y * q.half_v;
            float squared = dot(offset, offset);
            if (!(squared > 0.0)) continue;
            vec3 w = offset / sqrt(squared);
            if ((sides & (dot(p.normal, w) < 0.0 ? FRONT : BACK)) == 0) continue;
            vec3 v;
            bin = bin_between(p, q, w, v);
            if (bin == NONE || !is_on_its_way(q, p, p.center - q.center, v)) continue;
            float covered = disc_solid_angle(q.area / float(count) * abs(dot(q.normal, w)) / squared) * float(params.bins.count) / FOUR_PI;
            own = vec2(weight_between(p, q, w, v, covered), covered);
            if (bin == current) {
                sum += own;
                continue;
            }
        } else if (found == 0) {
            break;
        }
        if (current != NONE) {
            uint k = 0;
            while (k < found && bins[k] != current) ++k;
            if (k == found) {
                bins[found] = current;
                sums[found++] = vec2(0.0);
            }
            sums[k] += sum;
        }
        current = bin;
        sum = own;
    }
    // No bin is covered more than once: what is let through is then never more than what came.
    if (found == 0 && current != NONE) {
        transfers_follow(1);
        transfer(receiver, current, sender, current, sum.x / max(sum.y, 1.0));
    }
    if (found > 0) transfers_follow(found);
    for (uint k = 0; k < found; ++k) transfer(receiver, bins[k], sender, bins[k], sums[k].x / max(sums[k].y, 1.0));
}

// A flat sender close by, bin by bin: from beside a wall samples of it lie too far apart, and a cone is not its shape. Each pair of
// opposite sides holds, of a bin's width, what lies between the planes through them and the receiver; of a bin that a surface's own
// plane cuts only the part on the bin's side of it counts as the bin, so that a wall down to the floor fills the bins above the floor.
void clipped(uint sender, uint receiver, End q, End p, vec3 offset)
{
    vec3 inwards[4];                                    // across the planes, over a bin's width
    float per_width = sqrt(float(params.bins.count) / FOUR_PI);
    for (uint k = 0; k < 4; ++k) {
        vec3 to_side = k < 2 ? q.half_u : q.half_v, along = k < 2 ? q.half_v : q.half_u;
        vec3 normal = cross((k & 1) == 0 ? to_side - offset : -to_side - offset, along);
        float size = length(normal);
        inwards[k] = size > 0.0 ? normal * ((dot(normal, offset) < 0.0 ? per_width : -per_width) / size) : vec3(0.0);
    }
    float q_cos = dot(q.normal, offset);
    uint sides = sides_reached(q, p, offset);
    // Twice: how many bins there are is asked for first.
    uint found = 0;
    for (uint round = 0; round < 2; ++round) {
        if (round == 1) transfers_follow(found);
        // Of two opposite bins one is on the side of the sender that the receiver is on.
        for (uint first = 0; first < params.bins.count; first += 2) {
            vec3 v = BIN_DIRECTION(first);
            float sent_cos = dot(q.normal, v);
            uint bin = sent_cos * q_cos > 0.0 ? first : first + 1;
            if (bin != first) v = -v;
            float received_cos = dot(p.normal, v);
            if (sent_cos == 0.0 || (sides & (received_cos < 0.0 ? FRONT : BACK)) == 0 || !is_on_its_way(q, p, offset, v)) continue;
            float in_front_of_q = min(0.5 + per_width * abs(sent_cos), 1.0);
            vec4 held;
            for (uint k = 0; k < 4; ++k) held[k] = clamp((0.5 - dot(inwards[k], v)) / in_front_of_q, 0.0, 1.0);
            float share = max(held.x + held.y - 1.0, 0.0) * max(held.z + held.w - 1.0, 0.0);
            if (!(share > 0.0)) continue;
            if (p.is_flat) share /= min(0.5 + per_width * abs(received_cos), 1.0);
            if (round == 0) ++found;
            else transfer(receiver, bin, sender, bin, min(share, 1.0) / discrete_cosine(sent_cos, q.norm, params.bins.count));
        }
    }
}

void transfers_of(uint sender, uint receiver, End q, End p)
{
    vec3 offset = p.center - q.center;
    float squared = dot(offset, offset);
    if (!(squared > 0.0) || q.area <= 0.0) return;
    vec3 w = offset / sqrt(squared);
    float q_cos = dot(q.normal, w);
    float solid_angle = q.is_flat ? disc_solid_angle(q.area * abs(q_cos) / squared) : q.area / squared;
    if (!(solid_angle > 0.0)) return;
    // All of the sender lies behind a surface that nothing reaches from there.
    if (p.passes_behind && q.is_flat
        && dot(p.normal, offset) >= abs(dot(p.normal, q.half_u)) + abs(dot(p.normal, q.half_v))) return;
    float coverage = solid_angle * float(params.bins.count) / FOUR_PI;

    bool is_cone = params.bins.class_count > 0 && params.bins.is_gaussian == 0;
    if (is_cone && q.is_flat) {
        bool is_close = squared < 4.0 * (dot(q.half_u, q.half_u) + dot(q.half_v, q.half_v))
            && rectangle_solid_angle(offset, q.half_u, q.half_v) * float(params.bins.count) > FOUR_PI;
        if (is_close || coverage > MOST_SAMPLED) clipped(sender, receiver, q, p, offset);
        else sampled(sender, receiver, q, p, coverage);
        return;
    }
    // The class above, so that no bin is covered more than once and nothing is cut off.
    float doublings = log2(coverage);
    uint size_class = doublings < 0.25 ? 0u : min(uint(ceil(2.0 * doublings)), params.bins.class_count);
    uint middle = bin_of(w, params.bins.side);
    if (size_class == 0) {
        vec3 v;
        uint bin = bin_between(p, q, w, v);
        if (bin == NONE || (p.passes_behind && dot(p.normal, w) >= 0.0)) return;
        transfers_follow(1);
        transfer(receiver, bin, sender, bin, weight_between(p, q, w, v, coverage));
        return;
    }

    uint list = size_class * params.bins.count + middle;
    uint first = spread_offsets[list], last = spread_offsets[list + 1];
    float total = 0.0;
    uint found = 0;
    // The bin that a Gaussian reads: the nearest one on the sender's side.
    uint read_bin = NONE;
    for (uint k = first; k < last; ++k) {
        vec3 v = BIN_DIRECTION(spread[k].bin);
        if (!is_between(p, q, v, dot(p.normal, w), q_cos)) continue;
        if (read_bin == NONE) read_bin = spread[k].bin;
        if (!(p.passes_behind && dot(p.normal, v) >= 0.0)) found += 1;
        total += spread[k].weight;
    }
    if (!(total > 0.0) || found == 0) return;
    transfers_follow(found);
    for (uint k = first; k < last; ++k) {
        uint bin = spread[k].bin;
        vec3 v = BIN_DIRECTION(bin);
        if (!is_between(p, q, v, dot(p.normal, w), q_cos) || (p.passes_behind && dot(p.normal, v) >= 0.0)) continue;
        float weight = coverage * spread[k].weight / total;
        if (params.bins.is_gaussian == 0) {
            read_bin = bin;
        } else {
            v = BIN_DIRECTION(read_bin);
        }
        if (q.is_flat) weight /= discrete_cosine(dot(q.normal, v), q.norm, params.bins.count);
        transfer(receiver, bin, sender, read_bin, weight);
    }
}

// Both directions of a link.
void transfers_of_link(uvec2 link)
{
    End x = end_of(link.x), y = end_of(link.y);
    for (uint direction = 0; direction < 2; ++direction) {
        transfers_of(link.x, link.y, x, y);
        End end = x;
        x = y;
        y = end;
        link = link.yx;
    }
}
#endif
