#version 460
#include "lib/prelude.glsl"
#include "lib/face_element.glsl"
#include "lib/pair_queue.glsl"

// One thread per pair of the step: claims places for the children of what is to be split and has none.
// reads counters, taken_pairs, decisions, cluster_skips   updates elements, pool   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Counters { PairCounters counters[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Taken { uvec2 taken_pairs[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Decisions { uint decisions[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Skips { uint cluster_skips[]; };
layout(set = 0, binding = 4, scalar) buffer Elements { FaceElement elements[]; };
layout(set = 0, binding = 5, scalar) buffer Pool { PoolCounters pool[]; };
layout(push_constant, scalar) uniform Params { uint capacity; } params;

void main()
{
    uint i = linear_index();
    if (i >= counters[0].taken) return;
    uint decision = decisions[i] & ~IN_SHADOW;
    if (decision == PAIR_IS_DONE || decision == PAIR_WAITS) return;

    // Whoever is first claims them; other kernels read the place only after this one.
    uint index = decision == SPLIT_SHOOTER ? taken_pairs[i].y & ~IN_SHADOW : taken_pairs[i].x;
    if (atomicCompSwap(elements[index].children, NO_FACE_ELEMENT, NO_FACE_ELEMENT - 1) != NO_FACE_ELEMENT) return;
    uint first = atomicAdd(pool[0].element_count, 2);
    if (first + 2 > params.capacity) {
        pool[0].is_full = 1;
        elements[index].children = NO_FACE_ELEMENT;
        return;
    }
    uint left = elements[index].cluster + 1;
    for (uint k = 0; k < 2; ++k) {
        elements[first + k].cluster = k == 0 ? left : cluster_skips[left];
        elements[first + k].parent = index;
    }
    elements[index].children = first;
}
