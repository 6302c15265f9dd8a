#version 460
#include "lib/prelude.glsl"
#include "lib/bins.glsl"
#include "lib/emitter.glsl"
#include "lib/quadtree.glsl"

// One thread per leaf of a window and word of samples: which points on emitters it sees. The bins of both are an
// omnidirectional shadow map whose pixels say which surface is there: that surface, not the pixel, hides the point.
//                                                                                                  [Dong2007 3]
// reads winners[6 n n * leaf_count of the window], receivers, leaf_elements, samples[sample_count], triangles, positions,
// sample_slots[sample_count] (of emitter_winners, front and back), emitter_leaves, emitter_winners[6 n n * emitter leaves],
// walk_texels, walk_starts[node_count], leaf_cells, corner_texels
// writes visible[element_count * ceil(sample_count / 32)] (bits)   shared none
// Differs from [Dong2007]: every point is tested, so that an emitter smaller than a bin keeps its size and its shadow.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Winners { uint winners[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Receivers { Receiver receivers[]; };
layout(set = 0, binding = 2, scalar) readonly buffer LeafElements { uint leaf_elements[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Samples { EmitterSample samples[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 6, scalar) readonly buffer SampleSlots { uvec2 sample_slots[]; };
layout(set = 0, binding = 7, scalar) readonly buffer EmitterLeaves { uint emitter_leaves[]; };
layout(set = 0, binding = 8, scalar) readonly buffer EmitterWinners { uint emitter_winners[]; };
layout(set = 0, binding = 9) uniform usamplerBuffer walk_texels;
layout(set = 0, binding = 10, scalar) readonly buffer WalkStarts { uint walk_starts[]; };
layout(set = 0, binding = 11, scalar) readonly buffer LeafCells { LeafCell leaf_cells[]; };
layout(set = 0, binding = 12) uniform usamplerBuffer corner_texels;
layout(set = 0, binding = 13, scalar) writeonly buffer Visible { uint visible[]; };
layout(push_constant, scalar) uniform Params {
    uint first_leaf;
    uint leaf_count;    // of the window
    uint n;
    uint sample_count;
    uint all_leaves;
    float ray_offset;   // m
} params;

#include "methods/implicit_visibility/hidden.glsl"

// A point is hidden where the surface of a winner passes before it: of the bins around its direction, which know what stands
// near the leaf, and of those of its emitter around the way back, which know what stands near the point. The surface is all
// that lies below the node two levels above the winner.
bool is_visible(uint local, Receiver at, uint slot, Receiver from, vec3 point)
{
    vec3 way = point - at.origin;
    uvec4 looked_at = uvec4(EMPTY_BIN), looked_back_at = uvec4(EMPTY_BIN);
    bool is_hidden = false;
    uint corner = 0;
    do {
        uint winner = EMPTY_BIN;
        if (corner < 4) winner = winners[bin_beside(turn_back(at.frame, way), corner, params.n) * params.leaf_count + local];
        else winner = emitter_winners[slot * 6 * params.n * params.n + bin_beside(turn_back(from.frame, -way), corner - 4, params.n)];
        uint start = winner == EMPTY_BIN ? EMPTY_BIN : walk_starts[winner & NODE_MASK];
        bool is_new = start != EMPTY_BIN && all(notEqual(looked_at, uvec4(start))) && all(notEqual(looked_back_at, uvec4(start)));
        if (is_new) is_hidden = is_met(start, at.origin, way);
        if (corner < 4) looked_at[corner] = start;
        else looked_back_at[corner - 4] = start;
    } while (++corner < 8 && !is_hidden);
    return !is_hidden;
}

void main()
{
    uint words = (params.sample_count + 31) / 32;
    uint i = linear_index();
    if (i >= params.leaf_count * words) return;
    uint local = i % params.leaf_count, word = i / params.leaf_count;
    Receiver at = receivers[params.first_leaf + local];
    uint bits = 0;
    for (uint k = 0; k < 32 && word * 32 + k < params.sample_count; ++k) {
        EmitterSample s = samples[word * 32 + k];
        uvec3 v = triangles[s.triangle];
        EmitterPoint point = emitter_point(s, positions[v.x], positions[v.y], positions[v.z]);
        vec3 offset = point.position - at.origin;
        if (dot(offset, at.normal) <= 0.0 || emitter_cosine(s, point, -offset) <= 0.0) continue;
        // As shadow rays do, end a little before the emitter, on the side that is seen.
        bool is_back = dot(point.normal, offset) > 0.0;
        vec3 end = point.position + point.normal * (is_back ? -params.ray_offset : params.ray_offset);
        uint slot = is_back ? sample_slots[word * 32 + k].y : sample_slots[word * 32 + k].x;
        if (is_visible(local, at, slot, receivers[emitter_leaves[slot]], end)) bits |= 1u << k;
    }
    visible[leaf_elements[params.first_leaf + local] * words + word] = bits;
}
