#version 460
#include "lib/prelude.glsl"

// One workgroup per 1024 nodes and bin: cells (bins of receivers) with transfers, sorted by bin and class of length.
// reads cells[bin_count * node_count] (counts)   updates class_counts[bin_count * (LENGTH_CLASSES + 1)] (in: where each class
// starts)   writes work[slot_count] (cells, in any order within a class)   shared a count per class
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Cells { uint cells[]; };
layout(set = 0, binding = 1, scalar) buffer ClassCounts { uint class_counts[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Work { uint work[]; };
layout(push_constant, scalar) uniform Params { uint node_count; } params;

#include "methods/antiradiance/slices.glsl"

shared uint sh_counts[LENGTH_CLASSES];

void main()
{
    uint thread = gl_LocalInvocationID.x, bin = gl_WorkGroupID.y, row = bin * params.node_count;
    uint first = gl_WorkGroupID.x * 1024, end = min(first + 1024, params.node_count);
    if (thread < LENGTH_CLASSES) sh_counts[thread] = 0;
    barrier();
    for (uint node = first + thread; node < end; node += 64) {
        uint length = cells[row + node];
        if (length > 0) atomicAdd(sh_counts[length_class(length)], 1);
    }
    barrier();
    // A place for all of this workgroup's cells of a class at once.
    if (thread < LENGTH_CLASSES && sh_counts[thread] > 0)
        sh_counts[thread] = atomicAdd(class_counts[bin * (LENGTH_CLASSES + 1) + thread], sh_counts[thread]);
    barrier();
    for (uint node = first + thread; node < end; node += 64) {
        uint length = cells[row + node];
        if (length > 0) work[atomicAdd(sh_counts[length_class(length)], 1)] = row + node;
    }
}
