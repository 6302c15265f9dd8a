#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/link.glsl"

// One workgroup of 32 threads per row: a batch's rows move to their places in the list of links.
// reads row_offsets[batch_count + 1] (scanned counts), row_entries[batch_count * row_capacity]
// writes links[window_base + row_offsets[batch_count]], link_offsets[first_element + batch_count + 1]   shared none
layout(local_size_x = 32) in;
layout(set = 0, binding = 0, scalar) readonly buffer RowOffsets { uint row_offsets[]; };
layout(set = 0, binding = 1, scalar) readonly buffer RowEntries { RowEntry row_entries[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Links { uint64_t links[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer LinkOffsets { uint link_offsets[]; };
layout(push_constant, scalar) uniform Params {
    uint first_element;
    uint batch_count;
    uint row_capacity;
    uint link_base;         // links before this batch, in all windows
    uint window_base;       // and in this window
    float unit_weight;      // weight of one unit
} params;

void main()
{
    uint row = gl_WorkGroupID.x + gl_WorkGroupID.y * gl_NumWorkGroups.x;
    if (row >= params.batch_count) return;

    uint first = row_offsets[row], count = row_offsets[row + 1] - first;
    for (uint k = gl_LocalInvocationID.x; k < count; k += 32) {
        RowEntry entry = row_entries[row * params.row_capacity + k];
        links[params.window_base + first + k] =
            packUint2x32(uvec2(entry.sender, floatBitsToUint(float(entry.weight) * params.unit_weight)));
    }
    if (gl_LocalInvocationID.x == 0) {
        link_offsets[params.first_element + row] = params.link_base + first;
        if (row + 1 == params.batch_count) link_offsets[params.first_element + row + 1] = params.link_base + first + count;
    }
}
