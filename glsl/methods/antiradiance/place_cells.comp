#version 460
#include "lib/prelude.glsl"
#include "lib/hierarchy.glsl"

// One thread per cell in a slice: where its first transfer goes.
// reads work[slot_count] (cells, or NONE), slice_offsets[slot_count / SLICE + 1]
// updates cells[bin_count * node_count] (in: counts; out: places)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Work { uint work[]; };
layout(set = 0, binding = 1, scalar) readonly buffer SliceOffsets { uint slice_offsets[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Cells { uint cells[]; };
layout(push_constant, scalar) uniform Params { uint slot_count; } params;

#include "methods/antiradiance/slices.glsl"

void main()
{
    uint slot = linear_index();
    if (slot >= params.slot_count) return;
    uint cell = work[slot];
    if (cell != NONE) cells[cell] = slice_offsets[slot / SLICE] + slot % SLICE;
}
