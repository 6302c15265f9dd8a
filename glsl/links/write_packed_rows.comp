#version 460
#include "lib/prelude.glsl"
#include "lib/link.glsl"

// One thread per row: a batch's rows move to their places in the list of packed links. Each link takes the difference of
// the row's rounded sums before and with it, so that the sum of a row is kept.
// reads row_offsets[batch_count + 1] (scanned counts), row_entries[batch_count * row_capacity]
// writes packed_links[window_base + row_offsets[batch_count]], link_offsets[first_element + batch_count + 1]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer RowOffsets { uint row_offsets[]; };
layout(set = 0, binding = 1, scalar) readonly buffer RowEntries { RowEntry row_entries[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer PackedLinks { uint packed_links[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer LinkOffsets { uint link_offsets[]; };
layout(push_constant, scalar) uniform Params {
    uint first_element;
    uint batch_count;
    uint row_capacity;
    uint link_base;         // links before this batch, in all windows
    uint window_base;       // and in this window
    uint unit_divisor;      // units of an entry to one of a packed link
} params;

uint rounded(uint weight) { return (weight + params.unit_divisor / 2) / params.unit_divisor; }

void main()
{
    uint row = linear_index();
    if (row >= params.batch_count) return;

    uint first = row_offsets[row], count = row_offsets[row + 1] - first;
    uint before = 0;
    for (uint k = 0; k < count; ++k) {
        RowEntry entry = row_entries[row * params.row_capacity + k];
        uint weight = rounded(before + entry.weight) - rounded(before);
        before += entry.weight;
        packed_links[params.window_base + first + k] = entry.sender << PACKED_WEIGHT_BITS | min(weight, PACKED_UNITS - 1);
    }
    link_offsets[params.first_element + row] = params.link_base + first;
    if (row + 1 == params.batch_count) link_offsets[params.first_element + row + 1] = params.link_base + first + count;
}
