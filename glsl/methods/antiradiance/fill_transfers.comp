#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/direction_bins.glsl"
#include "lib/hierarchy.glsl"

// One thread per link, both of its directions: writes what they transfer to the receivers of one window.
// reads links, nodes, leaves, cosine_norms, bin_directions, spread_offsets, spread
// updates cell_offsets[node_count * bin_count + 1]: in, the start of each cell; out, its end
// writes transfers[window] (sender * bin_count + bin, weight), in any order within a cell   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Links { uvec2 links[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Nodes { HierarchyNode nodes[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Leaves { HierarchyLeaf leaves[]; };
layout(set = 0, binding = 3, scalar) readonly buffer CosineNorms { float cosine_norms[]; };
layout(set = 0, binding = 4, scalar) readonly buffer BinDirections { vec3 bin_directions[]; };
layout(set = 0, binding = 5, scalar) readonly buffer SpreadOffsets { uint spread_offsets[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Spread { SpreadEntry spread[]; };
layout(set = 0, binding = 7, scalar) buffer CellOffsets { uint cell_offsets[]; };
layout(set = 0, binding = 8, scalar) writeonly buffer Transfers { uint64_t transfers[]; };
layout(push_constant, scalar) uniform Params {
    BinParams bins;
    uint link_count;
    uint first_receiver;    // of the window
    uint end_receiver;
    uint first_transfer;    // of the window, among all
} params;

#include "methods/antiradiance/transfers.glsl"

void transfer(uint receiver, uint receiver_bin, uint sender, uint sender_bin, float weight)
{
    uint slot = atomicAdd(cell_offsets[receiver * params.bins.count + receiver_bin], 1);
    transfers[slot - params.first_transfer] = packUint2x32(uvec2(sender * params.bins.count + sender_bin, floatBitsToUint(weight)));
}

void main()
{
    uint i = linear_index();
    if (i >= params.link_count) return;
    uvec2 link = links[i];
    if (link.y >= params.first_receiver && link.y < params.end_receiver) transfers_of(link.x, link.y);
    if (link.x >= params.first_receiver && link.x < params.end_receiver) transfers_of(link.y, link.x);
}
