#version 460
#include "lib/prelude.glsl"
#include "lib/face_element.glsl"
#include "lib/pair_queue.glsl"

// One thread per pair of the step: what it is split into goes back on the stack.              [Gobbetti2003 Alg. 1]
// reads taken_pairs, decisions, elements   updates counters, pool, pair_stack   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Taken { uvec2 taken_pairs[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Decisions { uint decisions[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Elements { FaceElement elements[]; };
layout(set = 0, binding = 3, scalar) buffer Counters { PairCounters counters[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer Stack { uvec2 pair_stack[]; };
layout(set = 0, binding = 5, scalar) buffer Pool { PoolCounters pool[]; };

void main()
{
    uint i = linear_index();
    if (i >= counters[0].taken) return;
    if (i == 0) pool[0].made_count = pool[0].element_count;
    uint decision = decisions[i] & ~IN_SHADOW, shadow = decisions[i] & IN_SHADOW;
    if (decision == PAIR_IS_DONE) return;

    uvec2 pair = taken_pairs[i];
    uint shooter = pair.y & ~IN_SHADOW, first = elements[decision == SPLIT_SHOOTER ? shooter : pair.x].children;
    // Without children only where the pool is full: decided again when there is room.
    if (decision == PAIR_WAITS || first == NO_FACE_ELEMENT) {
        pair_stack[atomicAdd(counters[0].top, 1)] = pair;
        return;
    }
    uint count = decision == SPLIT_BOTH ? 4 : 2;
    uint slot = atomicAdd(counters[0].top, count);
    for (uint k = 0; k < count; ++k) {
        uvec2 child = decision == SPLIT_BOTH ? first + uvec2(k & 1u, k >> 1)
            : decision == SPLIT_RECEIVER ? uvec2(first + k, shooter | shadow) : uvec2(pair.x, (first + k) | shadow);
        pair_stack[slot + k] = child;
    }
}
