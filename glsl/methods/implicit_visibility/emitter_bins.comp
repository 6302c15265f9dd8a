#version 460
#include "lib/prelude.glsl"

// One thread per (leaf of an emitter, bin): what the emitter sees there, beside each other for those that look at it.
// reads emitter_leaves[count], winners[bin_count * leaf_count of the window]   updates emitter_winners[count * bin_count]
// (leaves of other windows stay)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer EmitterLeaves { uint emitter_leaves[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Winners { uint winners[]; };
layout(set = 0, binding = 2, scalar) buffer EmitterWinners { uint emitter_winners[]; };
layout(push_constant, scalar) uniform Params {
    uint first_leaf;
    uint leaf_count;    // of the window
    uint bin_count;
    uint count;
} params;

void main()
{
    uint i = linear_index();
    if (i >= params.count * params.bin_count) return;
    uint local = emitter_leaves[i / params.bin_count] - params.first_leaf;
    if (local < params.leaf_count) emitter_winners[i] = winners[i % params.bin_count * params.leaf_count + local];
}
