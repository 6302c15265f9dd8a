#version 460
#include "lib/prelude.glsl"
#include "lib/pair_queue.glsl"
#include "methods/face_cluster/make_element.glsl"

// Two threads' work per pair of the step: makes the elements claimed in this step.            [Gobbetti2003 3.3.4]
// reads counters and the tables of make_element   updates elements   writes element_nodes, fits, function_means   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 15, scalar) readonly buffer Counters { PairCounters counters[]; };
layout(push_constant, scalar) uniform Params { uint capacity; float ray_offset; } params;

void main()
{
    uint end = min(pool[0].element_count, params.capacity);
    [[dont_unroll]] for (uint half_step = 0; half_step < 2; ++half_step) {
        uint i = linear_index();
        if (i >= counters[0].taken) return;
        uint e = pool[0].made_count + i + half_step * counters[0].taken;
        if (e >= end) continue;
        uint parent = elements[e].parent;
        make_element(e, elements[parent].instance, elements[e].cluster, parent, elements[parent].level + 1, params.ray_offset);
    }
}
