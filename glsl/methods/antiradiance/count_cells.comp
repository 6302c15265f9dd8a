#version 460
#include "lib/prelude.glsl"

// One workgroup per 1024 nodes and bin: how many cells (bins of receivers) have how many transfers, by class of length; and
// how many there are of all.
// reads cells[bin_count * node_count] (counts)   updates class_counts[bin_count * (LENGTH_CLASSES + 1)] (the last of a bin:
// transfers)   shared a count per class
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Cells { uint cells[]; };
layout(set = 0, binding = 1, scalar) buffer ClassCounts { uint class_counts[]; };
layout(push_constant, scalar) uniform Params { uint node_count; } params;

#include "methods/antiradiance/slices.glsl"

shared uint sh_counts[LENGTH_CLASSES + 1];

void main()
{
    uint thread = gl_LocalInvocationID.x, bin = gl_WorkGroupID.y, row = bin * params.node_count;
    uint first = gl_WorkGroupID.x * 1024, end = min(first + 1024, params.node_count);
    if (thread <= LENGTH_CLASSES) sh_counts[thread] = 0;
    barrier();
    for (uint node = first + thread; node < end; node += 64) {
        uint length = cells[row + node];
        if (length == 0) continue;
        atomicAdd(sh_counts[length_class(length)], 1);
        atomicAdd(sh_counts[LENGTH_CLASSES], length);
    }
    barrier();
    if (thread <= LENGTH_CLASSES && sh_counts[thread] > 0)
        atomicAdd(class_counts[bin * (LENGTH_CLASSES + 1) + thread], sh_counts[thread]);
}
