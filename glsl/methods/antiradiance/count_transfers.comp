#version 460
#include "lib/prelude.glsl"
#include "lib/direction_bins.glsl"
#include "lib/hierarchy.glsl"

// One thread per link, both of its directions: how many transfers arrive in each bin of each receiver.
// reads links, nodes, leaves, cosine_norms, bin_directions, spread_offsets, spread
// updates cells[bin_count * node_count] (counts)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Links { uvec2 links[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Nodes { HierarchyNode nodes[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Leaves { HierarchyLeaf leaves[]; };
layout(set = 0, binding = 3, scalar) readonly buffer CosineNorms { float cosine_norms[]; };
layout(set = 0, binding = 4, scalar) readonly buffer BinDirections { vec3 bin_directions[]; };
layout(set = 0, binding = 5, scalar) readonly buffer SpreadOffsets { uint spread_offsets[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Spread { SpreadEntry spread[]; };
layout(set = 0, binding = 7, scalar) buffer Cells { uint cells[]; };
layout(push_constant, scalar) uniform Params { BinParams bins; uint link_count; uint node_count; } params;

#include "methods/antiradiance/transfers.glsl"

void transfer(uint receiver, uint receiver_bin, uint sender, uint sender_bin, float weight)
{
    atomicAdd(cells[receiver_bin * params.node_count + receiver], 1);
}

void main()
{
    uint i = linear_index();
    if (i >= params.link_count) return;
    uvec2 link = links[i];
    for (uint direction = 0; direction < 2; ++direction) transfers_of(link[direction], link[1 - direction]);
}
