#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/transfer.glsl"

// One thread per transfer that count_transfers found: writes it into its cell, if that is one of the window's.
// reads found[found_count]
// updates cells[bin_count * node_count]: in, the place of each cell's first transfer; out, one beyond its last
// writes transfers[window] (sender's entry of a table, weight), in any order within a cell   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Found { FoundTransfer found[]; };
layout(set = 0, binding = 1, scalar) buffer Cells { uint cells[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Transfers { uint64_t transfers[]; };
layout(push_constant, scalar) uniform Params {
    uint found_count;
    uint first_cell;        // of the window
    uint end_cell;
    uint first_transfer;    // of the window, among all
} params;

#include "methods/antiradiance/slices.glsl"

void main()
{
    uint i = linear_index();
    if (i >= params.found_count) return;
    uint cell = found[i].cell;
    if (cell < params.first_cell || cell >= params.end_cell) return;
    uint place = atomicAdd(cells[cell], SLICE);
    transfers[place - params.first_transfer] = packUint2x32(uvec2(found[i].entry, floatBitsToUint(found[i].weight)));
}
