#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/hierarchy.glsl"

// One thread per cell (a bin of a receiver) that anything reaches: incident radiance along its transfers.   [Dachsbacher2007 4.2 global pass]
// reads work[] (cells by slices, or NONE), slice_offsets[slice_count + 1], transfers[window], exitant[window's bins * node_count]
// (W m^-2 sr^-1: intensity per area)   writes incident[window's bins * node_count] (radiance, W m^-2 sr^-1)   shared none
layout(local_size_x = 64) in;
layout(constant_id = 0) const uint WORDS = 2;    // of 64 bits an entry of the tables: 2 (f32) or 1 (f16)
layout(set = 0, binding = 0, scalar) readonly buffer SliceOffsets { uint slice_offsets[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Transfers { uint64_t transfers[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Exitant { uint64_t exitant[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Incident { uint64_t incident[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Work { uint work[]; };
layout(push_constant, scalar) uniform Params {
    uint first_slice;       // of the window of transfers
    uint slice_count;
    uint first_entry;       // of the tables' window
} params;

#include "methods/antiradiance/slices.glsl"
#include "methods/antiradiance/table.glsl"

vec3 carried(uint k)
{
    uvec2 transfer = unpackUint2x32(transfers[k]);
    return uintBitsToFloat(transfer.y) * LOAD_ENTRY(exitant, transfer.x - params.first_entry);
}

void main()
{
    uint i = linear_index();
    if (i >= params.slice_count * SLICE) return;
    uint slice = params.first_slice + i / SLICE, lane = i % SLICE, first_transfer = slice_offsets[params.first_slice];
    uint k = slice_offsets[slice] - first_transfer + lane, last = slice_offsets[slice + 1] - first_transfer;
    // What a shorter cell than its neighbours has at its end weighs nothing.
    vec3 sum = vec3(0.0);
    for (; k + 3 * SLICE < last; k += 4 * SLICE)
        sum += carried(k) + carried(k + SLICE) + carried(k + 2 * SLICE) + carried(k + 3 * SLICE);
    for (; k < last; k += SLICE) sum += carried(k);
    uint cell = work[slice * SLICE + lane];
    if (cell != NONE) STORE_ENTRY(incident, cell - params.first_entry, sum);
}
