#version 460
#include "lib/prelude.glsl"

// One thread: the workgroups of a list whose length an earlier pass left, within what the device allows; rows as in
// Recorder::dispatch.
// reads thread_counts   writes groups[3]   shared none
layout(local_size_x = 1) in;
layout(set = 0, binding = 0, scalar) readonly buffer ThreadCounts { uint thread_counts[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Groups { uint groups[]; };
layout(push_constant, scalar) uniform Params {
    uint index;             // of the count
    uint group_size;        // threads of a workgroup
    uint most;              // workgroups in one dimension
} params;

void main()
{
    uint threads = thread_counts[params.index];
    uint wanted = threads / params.group_size + uint(threads % params.group_size > 0);
    uint rows = max(wanted / params.most + uint(wanted % params.most > 0), 1u);
    groups[0] = wanted / rows + uint(wanted % rows > 0);
    groups[1] = min(rows, params.most);
    groups[2] = 1;
}
