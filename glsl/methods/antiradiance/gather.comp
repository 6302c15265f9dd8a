#version 460
#include "lib/prelude.glsl"

// One thread per cell (a bin of a receiver) of a window: incident radiance along its transfers.   [Dachsbacher2007 4.2 global pass]
// reads cell_offsets[node_count * bin_count + 1] (ends of cells), transfers[window], exitant[node_count * bin_count]
// (W m^-2 sr^-1: intensity per area)   writes incident[node_count * bin_count] (radiance, W m^-2 sr^-1)   shared none
layout(local_size_x = 64) in;
layout(constant_id = 0) const uint WORDS = 3;    // of an entry of the tables: 3 (f32) or 2 (f16)
layout(set = 0, binding = 0, scalar) readonly buffer CellOffsets { uint cell_offsets[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Transfers { uvec2 transfers[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Exitant { uint exitant[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Incident { uint incident[]; };
layout(push_constant, scalar) uniform Params {
    uint first_cell;
    uint cell_count;
    uint first_transfer;    // of the window, among all
} params;

#include "methods/antiradiance/table.glsl"

void main()
{
    uint i = linear_index();
    if (i >= params.cell_count) return;
    uint cell = params.first_cell + i;
    uint k = (cell == 0 ? 0 : cell_offsets[cell - 1]) - params.first_transfer;
    uint last = cell_offsets[cell] - params.first_transfer;
    vec3 sum = vec3(0.0);
    for (; k < last; ++k) {
        uvec2 transfer = transfers[k];
        sum += uintBitsToFloat(transfer.y) * LOAD_ENTRY(exitant, transfer.x);
    }
    STORE_ENTRY(incident, cell, sum);
}
