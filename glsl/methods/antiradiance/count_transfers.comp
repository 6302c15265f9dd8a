#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/direction_bins.glsl"
#include "lib/transfer.glsl"

// One thread per link, both of its directions: how many transfers arrive in each bin of each receiver; and the transfers, as
// far as there is room for them.
// reads links, node_texels, cosine_norms, bin_directions, spread_offsets, spread
// updates cells[bin_count * node_count] (counts), found_count[1] (of all)   writes found[capacity] (in any order)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Links { uvec2 links[]; };
layout(set = 0, binding = 1) uniform usamplerBuffer node_texels;     // HIERARCHY_TEXELS each
layout(set = 0, binding = 2, scalar) readonly buffer CosineNorms { float cosine_norms[]; };
layout(set = 0, binding = 3, scalar) readonly buffer BinDirections { uint64_t bin_directions[]; };
layout(set = 0, binding = 4, scalar) readonly buffer SpreadOffsets { uint spread_offsets[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Spread { SpreadEntry spread[]; };
layout(set = 0, binding = 6, scalar) buffer Cells { uint cells[]; };
layout(set = 0, binding = 7, scalar) buffer FoundCount { uint found_count[]; };
layout(set = 0, binding = 8, scalar) writeonly buffer Found { FoundTransfer found[]; };
layout(push_constant, scalar) uniform Params { BinParams bins; uint link_count; uint node_count; uint capacity; } params;

#include "methods/antiradiance/transfers.glsl"

uint place;

void transfers_follow(uint count) { place = atomicAdd(found_count[0], count); }

void transfer(uint receiver, uint receiver_bin, uint sender, uint sender_bin, float weight)
{
    uint cell = receiver_bin * params.node_count + receiver;
    atomicAdd(cells[cell], 1);
    if (place < params.capacity) found[place] = FoundTransfer(cell, sender_bin * params.node_count + sender, weight);
    place += 1;
}

void main()
{
    uint i = linear_index();
    if (i >= params.link_count) return;
    transfers_of_link(links[i]);
}
