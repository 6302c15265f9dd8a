#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/hierarchy.glsl"

// One thread per cell (a bin of a receiver) of a window: its transfers by rising sender, so that sums do not depend on the
// order in which threads wrote them. No two have the same sender and bin.
// reads work[] (cells, or NONE), slice_offsets, cells[bin_count * node_count] (one beyond each cell's last transfer)
// updates transfers[window]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Work { uint work[]; };
layout(set = 0, binding = 1, scalar) readonly buffer SliceOffsets { uint slice_offsets[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Cells { uint cells[]; };
layout(set = 0, binding = 3, scalar) buffer Transfers { uint64_t transfers[]; };
layout(push_constant, scalar) uniform Params {
    uint first_slice;       // of the window
    uint slice_count;
} params;

#include "methods/antiradiance/slices.glsl"

void main()
{
    uint i = linear_index();
    if (i >= params.slice_count * SLICE) return;
    uint slice = params.first_slice + i / SLICE, lane = i % SLICE, cell = work[slice * SLICE + lane];
    if (cell == NONE) return;
    uint start = slice_offsets[slice] + lane, count = (cells[cell] - start) / SLICE;
    uint first = start - slice_offsets[params.first_slice];

    // Shell's sort: cells are short, most hold one transfer or none.                          [Ciura2001 gaps]
    const uint gaps[6] = uint[6](301, 132, 57, 23, 4, 1);
    for (uint g = 0; g < 6; ++g) {
        uint gap = gaps[g];
        for (uint k = gap; k < count; ++k) {
            uint64_t moved = transfers[first + k * SLICE];
            uint sender = unpackUint2x32(moved).x;
            uint at = k;
            while (at >= gap && unpackUint2x32(transfers[first + (at - gap) * SLICE]).x > sender) {
                transfers[first + at * SLICE] = transfers[first + (at - gap) * SLICE];
                at -= gap;
            }
            transfers[first + at * SLICE] = moved;
        }
    }
}
