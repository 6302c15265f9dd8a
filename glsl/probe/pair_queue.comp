#version 460
#include "lib/prelude.glsl"
#include "lib/pair_queue.glsl"

// One thread per pair of a step, for tests of the queue: a pair (first, end) of whole numbers is split into `ways`, down
// to single ones, each of which is counted.
// reads taken_pairs   updates counters, pair_stack   updates seen[] (visits of each number)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Taken { uvec2 taken_pairs[]; };
layout(set = 0, binding = 1, scalar) buffer Counters { PairCounters counters[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Stack { uvec2 pair_stack[]; };
layout(set = 0, binding = 3, scalar) buffer Seen { uint seen[]; };
layout(push_constant, scalar) uniform Params { uint ways; } params;

void main()
{
    uint i = linear_index();
    if (i >= counters[0].taken) return;

    uvec2 span = taken_pairs[i];
    uint width = span.y - span.x;
    if (width == 1) {
        atomicAdd(seen[span.x], 1);
        atomicAdd(counters[0].accepted, 1);
        return;
    }
    uint parts = min(params.ways, width);
    uint slot = atomicAdd(counters[0].top, parts);
    for (uint k = 0; k < parts; ++k)
        pair_stack[slot + k] = uvec2(span.x + width * k / parts, span.x + width * (k + 1) / parts);
}
