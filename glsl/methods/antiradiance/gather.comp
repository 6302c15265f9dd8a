#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"

// One thread per cell (a bin of a receiver) that anything reaches: incident radiance along its transfers.   [Dachsbacher2007 4.2 global pass]
// reads work[work_count] (cells of a window; long ones first, so that neighbouring threads take as long), cell_offsets[node_count * bin_count + 1] (ends of cells), transfers[window], exitant[node_count * bin_count]
// (W m^-2 sr^-1: intensity per area)   writes incident[node_count * bin_count] (radiance, W m^-2 sr^-1)   shared none
layout(local_size_x = 64) in;
layout(constant_id = 0) const uint WORDS = 2;    // of 64 bits an entry of the tables: 2 (f32) or 1 (f16)
layout(set = 0, binding = 0, scalar) readonly buffer CellOffsets { uint cell_offsets[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Transfers { uint64_t transfers[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Exitant { uint64_t exitant[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Incident { uint64_t incident[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Work { uint work[]; };
layout(push_constant, scalar) uniform Params {
    uint work_count;
    uint first_transfer;    // of the window, among all
} params;

#include "methods/antiradiance/table.glsl"

vec3 carried(uint k)
{
    uvec2 transfer = unpackUint2x32(transfers[k]);
    return uintBitsToFloat(transfer.y) * LOAD_ENTRY(exitant, transfer.x);
}

void main()
{
    uint i = linear_index();
    if (i >= params.work_count) return;
    uint cell = work[i];
    uint k = (cell == 0 ? 0 : cell_offsets[cell - 1]) - params.first_transfer;
    uint last = cell_offsets[cell] - params.first_transfer;
    vec3 sum = vec3(0.0);
    for (; k + 4 <= last; k += 4) sum += carried(k) + carried(k + 1) + carried(k + 2) + carried(k + 3);
    for (; k < last; ++k) sum += carried(k);
    STORE_ENTRY(incident, cell, sum);
}
