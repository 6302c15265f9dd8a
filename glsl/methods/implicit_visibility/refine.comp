#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_shader_atomic_int64 : require
#include "lib/prelude.glsl"
#include "lib/footprint.glsl"
#include "lib/pair_queue.glsl"
#include "lib/surfel.glsl"

// One thread per pair (receiver, sender) of a step: drops it, refines it, or proposes the sender to the receiver's bins,
// each of which keeps the nearest.                                                                 [Dong2007 4.2.2]
// reads taken_pairs, node_segments, surfels, moments [node_count], segments, receivers[leaf_count], bin_solid_angles[n * n] (sr),
// window_levels   updates counters, pair_stack, keys[rows * 6 n n] (distance bits above, back and node below)   shared none
// Differs from [Dong2007]: pairs are directed; a sender fills all the bins whose centres it covers, at its distance in
// each, and blocks where it turns its back.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Taken { uvec2 taken_pairs[]; };
layout(set = 0, binding = 1, scalar) buffer Counters { PairCounters counters[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Stack { uvec2 pair_stack[]; };
layout(set = 0, binding = 3, scalar) readonly buffer NodeSegments { uint node_segments[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Segments { QuadtreeSegment segments[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Surfels { Surfel surfels[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Receivers { Receiver receivers[]; };
layout(set = 0, binding = 7, scalar) readonly buffer BinSolidAngles { float bin_solid_angles[]; };
layout(set = 0, binding = 8, scalar) readonly buffer WindowLevels { WindowLevel window_levels[]; };
layout(set = 0, binding = 9, scalar) buffer Keys { uint64_t keys[]; };
layout(set = 0, binding = 10, scalar) readonly buffer Moments { SurfelMoments moments[]; };
layout(push_constant, scalar) uniform Params {
    uint n;                 // bins a side of a face
    float refinement;       // of a bin's solid angle, what a node may fill; 0 refines down to leaves
    uint is_single;         // 1: one bin a sender, as in the paper
    uint leaf_count;
} params;
uint row_first_key;
uint sender_word;

void propose(uint bin, float distance_there)
{
    uint64_t key = packUint2x32(uvec2(sender_word, floatBitsToUint(distance_there)));
    // Most proposals lose: look before taking the slow way.
    if (key < keys[row_first_key + bin]) atomicMin(keys[row_first_key + bin], key);
}

// Whether all of `b`, at `offset`, lies below the horizon of all points and normals of the receiver.
bool is_below_horizon(vec3 normal, float cos_cone, float radius, float thickness, vec3 offset, Surfel b)
{
    if (cos_cone <= 0.0) return false;
    float sin_cone = sqrt(max(1.0 - cos_cone * cos_cone, 0.0));
    float distance_between = length(offset);
    float along = dot(normal, offset), across = sqrt(max(distance_between * distance_between - along * along, 0.0));
    // Farthest above any plane of the cone that the centre comes.
    float highest = along >= cos_cone * distance_between ? distance_between : along * cos_cone + across * sin_cone;
    float own = radius * sin_cone + thickness * cos_cone;
    float cosine = min(abs(dot(normal, b.normal)), 1.0), sine = sqrt(1.0 - cosine * cosine);
    bool is_upright = cosine * cos_cone <= sine * sin_cone || b.normal == vec3(0.0);
    float reach = is_upright ? b.radius : min(b.radius, b.radius * (sine * cos_cone + cosine * sin_cone) + b.thickness);
    return highest + own + reach <= 1e-3 * distance_between;
}

void link(uint receiver, QuadtreeSegment of_receiver, Receiver at, vec3 offset, uint sender, Surfel b)
{
    WindowLevel level = window_levels[of_receiver.level];
    row_first_key = (level.row + receiver - level.first) * 6 * params.n * params.n;
    float plane = dot(b.normal, offset);
    sender_word = sender | (plane > 0.0 ? BACK_SEEN : 0u);
    vec3 local_offset = turn_back(at.frame, offset);
    if (params.is_single != 0) {
        propose(bin_of(local_offset, params.n), length(offset));
        return;
    }
    vec3 normal = b.normal, g1 = b.g1, g2 = b.g2;
    if (sender >= params.leaf_count && b.cos_cone < 0.5) {
        // A cluster without a plane: its outline as seen from here.
        Surfel outline = b;
        outline.normal = normalize(offset);
        shape_surfel(moments[sender], outline);
        normal = outline.normal;
        g1 = outline.g1 * (SURFEL_REACH / SURFEL_OUTLINE);
        g2 = outline.g2 * (SURFEL_REACH / SURFEL_OUTLINE);
    }
    // The longer semi-axis, from the smaller singular value of (g1, g2).
    float p = dot(g1, g1), q = dot(g1, g2), r = dot(g2, g2);
    float least = 0.5 * (p + r) - sqrt(0.25 * (p - r) * (p - r) + q * q);
    float reach = least > 0.0 ? min(1.0 / sqrt(least), 4.0 * b.extent) : 4.0 * b.extent;
    propose_footprint(local_offset, turn_back(at.frame, normal), turn_back(at.frame, g1), turn_back(at.frame, g2), reach,
                      params.n);
}

void main()
{
    uint i = linear_index();
    if (i >= counters[0].taken) return;

    uint receiver = taken_pairs[i].x, sender = taken_pairs[i].y;
    bool is_leaf = receiver < params.leaf_count, is_sender_leaf = sender < params.leaf_count;
    if (receiver == sender && is_leaf) return;
    QuadtreeSegment of_receiver = segments[node_segments[receiver]];
    Surfel a = surfels[receiver], b = surfels[sender];
    Receiver at = Receiver(a.centre, a.normal, vec4(0.0, 0.0, 0.0, 1.0));
    if (is_leaf) at = receivers[receiver];

    vec3 offset = b.centre - at.origin;
    // A leaf receives at one point with one normal.
    bool is_hidden = is_leaf ? is_below_horizon(at.normal, 1.0, 0.0, 0.0, offset, b)
                             : is_below_horizon(a.normal, a.cos_cone, a.radius, a.thickness, offset, b);
    if (is_hidden) return;

    // Whatever fills more than its bin is refined, where it can be.
    float squared = dot(offset, offset);
    uint bin = squared > 0.0 ? bin_of(turn_back(at.frame, offset), params.n) : 0u;
    float allowed = params.refinement * bin_solid_angles[bin % (params.n * params.n)] * squared;
    bool splits_sender = !is_sender_leaf && PI * b.extent * b.extent >= allowed;
    bool splits_receiver = !is_leaf && PI * a.extent * a.extent >= allowed;
    if (splits_sender && splits_receiver) {
        splits_sender = b.extent >= a.extent;
        splits_receiver = !splits_sender;
    }
    if (splits_sender || splits_receiver) {
        uvec2 children = splits_sender ? quadtree_children(segments[node_segments[sender]], sender)
                                       : quadtree_children(of_receiver, receiver);
        uint slot = atomicAdd(counters[0].top, children.y);
        for (uint k = 0; k < children.y; ++k)
            pair_stack[slot + k] = splits_sender ? uvec2(receiver, children.x + k) : uvec2(children.x + k, sender);
        return;
    }

    if (is_leaf && is_sender_leaf && dot(b.normal, offset) > 0.0
        && of_receiver.tree == segments[node_segments[sender]].tree
        && dot(offset, offset) < (a.radius + b.radius) * (a.radius + b.radius)) {
        // A neighbour on a convex surface: its flat surfel stands out over the curve, and would shade what is beside it.
        return;
    }
    atomicAdd(counters[0].accepted, 1);
    link(receiver, of_receiver, at, offset, sender, b);
}
