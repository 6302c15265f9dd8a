#version 460
#include "lib/prelude.glsl"

// One workgroup per 1024 cells (bins of receivers) of a window: how many have how many transfers, by class of length.
// reads cell_offsets[node_count * bin_count + 1] (ends of cells)   updates class_counts[WORK_CLASSES]   shared a count per class
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer CellOffsets { uint cell_offsets[]; };
layout(set = 0, binding = 1, scalar) buffer ClassCounts { uint class_counts[]; };
layout(push_constant, scalar) uniform Params {
    uint first_cell;
    uint cell_count;
} params;

#include "methods/antiradiance/work_classes.glsl"

shared uint sh_counts[WORK_CLASSES];

void main()
{
    uint thread = gl_LocalInvocationID.x;
    uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * gl_NumWorkGroups.x;
    uint first = params.first_cell + group * 1024, end = min(first + 1024, params.first_cell + params.cell_count);
    if (thread < WORK_CLASSES) sh_counts[thread] = 0;
    barrier();
    for (uint cell = first + thread; cell < end; cell += 64) {
        uint length = cell_length(cell);
        if (length > 0) atomicAdd(sh_counts[work_class(length)], 1);
    }
    barrier();
    if (thread < WORK_CLASSES && sh_counts[thread] > 0) atomicAdd(class_counts[thread], sh_counts[thread]);
}
