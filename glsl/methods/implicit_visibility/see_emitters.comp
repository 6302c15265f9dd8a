#version 460
#include "lib/prelude.glsl"
#include "lib/bins.glsl"
#include "lib/quadtree.glsl"
#include "methods/implicit_visibility/emitter_points.glsl"

// One thread per leaf of a window and word of samples: which points on emitters it sees. The bins of both are an
// omnidirectional shadow map whose pixels say which surface is there: that surface, not the pixel, hides the point.
//                                                                                                  [Dong2007 3]
// reads winners[6 n n * leaf_count of the window], receivers, leaf_elements, points[sample_count], bundles[words],
// sample_slots[sample_count] (place in its word; of emitter_winners, front and back), emitter_leaves, emitter_winners[6 n n * emitter leaves],
// walk_texels, walk_starts[node_count], leaf_cells, corner_texels
// writes visible[element_count * words] (bits; words = ceil(sample_count / 32))   shared none
// Differs from [Dong2007]: every point is tested, so that an emitter smaller than a bin keeps its size and its shadow.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Winners { uint winners[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Receivers { Receiver receivers[]; };
layout(set = 0, binding = 2, scalar) readonly buffer LeafElements { uint leaf_elements[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Points { PointSeen points[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Bundles { Bundle bundles[]; };
layout(set = 0, binding = 5, scalar) readonly buffer SampleSlots { uvec3 sample_slots[]; };
layout(set = 0, binding = 6, scalar) readonly buffer EmitterLeaves { uint emitter_leaves[]; };
layout(set = 0, binding = 7, scalar) readonly buffer EmitterWinners { uint emitter_winners[]; };
layout(set = 0, binding = 8) uniform usamplerBuffer walk_texels;
layout(set = 0, binding = 9, scalar) readonly buffer WalkStarts { uint walk_starts[]; };
layout(set = 0, binding = 10, scalar) readonly buffer LeafCells { LeafCell leaf_cells[]; };
layout(set = 0, binding = 11) uniform usamplerBuffer corner_texels;
layout(set = 0, binding = 12, scalar) writeonly buffer Visible { uint visible[]; };
layout(push_constant, scalar) uniform Params {
    uint first_leaf;
    uint leaf_count;    // of the window
    uint n;
    uint sample_count;
    uint all_leaves;
    float ray_offset;   // m
} params;
// 1: leaves' bins are not along the world's axes.
layout(constant_id = 0) const uint IS_TURNED = 0;

#include "methods/implicit_visibility/hidden.glsl"

CellBetween cell_of(uint leaf, vec3 direction)
{
    if (IS_TURNED != 0) direction = turn_back(receivers[leaf].frame, direction);
    return cell_between(direction, params.n);
}

// A point is hidden where the surface of a winner passes before it: of the bins around its direction, which know what stands
// near the leaf, and of those of its emitter around the way back, which know what stands near the point. Points of a word
// lie close together, and those at one vertex of the emitter follow each other: most fall into the cell between bins of
// the one before, and what none of their ways comes near is left out for all of them.
void main()
{
    uint words = (params.sample_count + 31) / 32, bins = 6 * params.n * params.n;
    uint i = linear_index();
    if (i >= params.leaf_count * words) return;
    uint local = i % params.leaf_count, word = i / params.leaf_count, leaf = params.first_leaf + local;
    vec3 origin = receivers[leaf].origin, normal = receivers[leaf].normal;
    vec3 to_middle = bundles[word].middle - origin;
    vec3 slack = bundles[word].half_size;
    uint bits = 0, own_number = EMPTY_BIN, their_number = EMPTY_BIN, their_slot = EMPTY_BIN;
    uvec4 own = uvec4(EMPTY_BIN), theirs = uvec4(EMPTY_BIN);
    for (uint k = 0; k < 32 && word * 32 + k < params.sample_count; ++k) {
        uvec3 at = sample_slots[word * 32 + k];
        PointSeen point = points[word * 32 + at.x];
        vec3 offset = point.position - origin;
        float away = dot(point.normal, offset);
        bool is_turned_away = point.is_double_sided != 0 ? away == 0.0 : away >= 0.0;
        if (dot(offset, normal) <= 0.0 || is_turned_away) continue;
        bool is_back = away > 0.0;
        vec3 way = end_of_way(point, is_back, params.ray_offset) - origin;

        CellBetween cell = cell_of(leaf, way);
        uint number = number_of(cell, params.n);
        if (number != own_number) {
            own_number = number;
            [[unroll]] for (uint corner = 0; corner < 4; ++corner) {
                uint winner = winners[bin_around(cell, corner, params.n) * params.leaf_count + local];
                own[corner] = start_near(start_below(winner), origin, to_middle, slack);
            }
        }
        uint slot = is_back ? at.z : at.y;
        cell = cell_of(IS_TURNED != 0 ? emitter_leaves[slot] : 0, -way);
        number = number_of(cell, params.n);
        if (number != their_number || slot != their_slot) {
            their_number = number;
            their_slot = slot;
            [[unroll]] for (uint corner = 0; corner < 4; ++corner) {
                uint winner = emitter_winners[slot * bins + bin_around(cell, corner, params.n)];
                theirs[corner] = start_near(start_below(winner), origin, to_middle, slack);
            }
        }
        bool is_hidden = false;
        uint side = any(notEqual(own & theirs, uvec4(EMPTY_BIN))) ? 0 : 2;
        while (side < 2 && !is_hidden) is_hidden = is_any_met(side++ == 0 ? own : theirs, origin, way);
        if (!is_hidden) bits |= 1u << at.x;
    }
    visible[leaf_elements[leaf] * words + word] = bits;
}
