#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"

// One thread per cell (a bin of a receiver) of a window: its transfers by rising sender, so that sums do not depend on the
// order in which threads wrote them. No two have the same sender and bin.
// reads cell_offsets[node_count * bin_count + 1] (ends of cells)   updates transfers[window]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer CellOffsets { uint cell_offsets[]; };
layout(set = 0, binding = 1, scalar) buffer Transfers { uint64_t transfers[]; };
layout(push_constant, scalar) uniform Params {
    uint first_cell;
    uint cell_count;
    uint first_transfer;    // of the window, among all
} params;

void main()
{
    uint i = linear_index();
    if (i >= params.cell_count) return;
    uint cell = params.first_cell + i;
    uint first = (cell == 0 ? 0 : cell_offsets[cell - 1]) - params.first_transfer;
    uint count = cell_offsets[cell] - params.first_transfer - first;

    // Shell's sort: cells are short, most hold one transfer or none.                          [Ciura2001 gaps]
    const uint gaps[6] = uint[6](301, 132, 57, 23, 4, 1);
    for (uint g = 0; g < 6; ++g) {
        uint gap = gaps[g];
        for (uint k = gap; k < count; ++k) {
            uint64_t moved = transfers[first + k];
            uint sender = unpackUint2x32(moved).x;
            uint at = k;
            while (at >= gap && unpackUint2x32(transfers[first + at - gap]).x > sender) {
                transfers[first + at] = transfers[first + at - gap];
                at -= gap;
            }
            transfers[first + at] = moved;
        }
    }
}
