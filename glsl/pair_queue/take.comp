#version 460
#include "lib/prelude.glsl"
#include "lib/pair_queue.glsl"

// One thread per pair of the step: moves it off the stack, whose place its children may take.
// reads counters, pair_stack[capacity]   writes taken_pairs[batch]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Counters { PairCounters counters[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Stack { uvec2 pair_stack[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Taken { uvec2 taken_pairs[]; };

void main()
{
    uint i = linear_index();
    if (i >= counters[0].taken) return;
    taken_pairs[i] = pair_stack[counters[0].top + i];
}
