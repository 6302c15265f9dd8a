#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/direction_bins.glsl"

// One thread per link, both of its directions: writes what they transfer into the bins of one window, where count_transfers
// had no room to keep it.
// reads links, node_texels, cosine_norms, bin_directions, spread_offsets, spread
// updates cells[bin_count * node_count]: in, the place of each cell's first transfer; out, one beyond its last
// writes transfers[window] (sender's entry of a table, weight), in any order within a cell   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Links { uvec2 links[]; };
layout(set = 0, binding = 1) uniform usamplerBuffer node_texels;     // HIERARCHY_TEXELS each
layout(set = 0, binding = 2, scalar) readonly buffer CosineNorms { float cosine_norms[]; };
layout(set = 0, binding = 3, scalar) readonly buffer BinDirections { uint64_t bin_directions[]; };
layout(set = 0, binding = 4, scalar) readonly buffer SpreadOffsets { uint spread_offsets[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Spread { SpreadEntry spread[]; };
layout(set = 0, binding = 6, scalar) buffer Cells { uint cells[]; };
layout(set = 0, binding = 7, scalar) writeonly buffer Transfers { uint64_t transfers[]; };
layout(push_constant, scalar) uniform Params {
    BinParams bins;
    uint link_count;
    uint node_count;
    uint first_bin;         // of the window
    uint end_bin;
    uint first_transfer;    // of the window, among all
} params;

#include "methods/antiradiance/slices.glsl"
#include "methods/antiradiance/transfers.glsl"

void transfers_follow(uint count) {}

void transfer(uint receiver, uint receiver_bin, uint sender, uint sender_bin, float weight)
{
    if (receiver_bin < params.first_bin || receiver_bin >= params.end_bin) return;
    uint place = atomicAdd(cells[receiver_bin * params.node_count + receiver], SLICE);
    transfers[place - params.first_transfer] =
        packUint2x32(uvec2(sender_bin * params.node_count + sender, floatBitsToUint(weight)));
}

void main()
{
    uint i = linear_index();
    if (i >= params.link_count) return;
    transfers_of_link(links[i]);
}
