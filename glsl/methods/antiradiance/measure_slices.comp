#version 460
#include "lib/prelude.glsl"
#include "lib/hierarchy.glsl"

// One thread per slice: how many transfers it has room for, as long as its longest cell.
// reads work[slice_count * SLICE] (cells, or NONE), cells[bin_count * node_count] (counts)
// writes slice_offsets[slice_count] (sizes)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Work { uint work[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Cells { uint cells[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer SliceOffsets { uint slice_offsets[]; };
layout(push_constant, scalar) uniform Params { uint slice_count; } params;

#include "methods/antiradiance/slices.glsl"

void main()
{
    uint slice = linear_index();
    if (slice >= params.slice_count) return;
    uint longest = 0;
    for (uint lane = 0; lane < SLICE; ++lane) {
        uint cell = work[slice * SLICE + lane];
        if (cell != NONE) longest = max(longest, cells[cell]);
    }
    slice_offsets[slice] = longest * SLICE;
}
