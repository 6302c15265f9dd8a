#ifndef LIB_PAIR_QUEUE
#define LIB_PAIR_QUEUE
// The queue of dual-tree refinement: a stack of node pairs, worked on from its top in steps of bounded size.
// A kernel of a step binds the tables under these names and finds its pairs at taken_pairs[i], i < counters[0].taken:
//     readonly buffer Taken { uvec2 taken_pairs[]; }      buffer Stack { uvec2 pair_stack[]; }
//     buffer Counters { PairCounters counters[]; }
// It puts what a pair is refined into back on the stack, at most the declared number of pairs for each:
//     uint slot = atomicAdd(counters[0].top, n); pair_stack[slot + k] = ...
// and counts what it accepts: uint slot = atomicAdd(counters[0].accepted, n). There is always room on the stack; room
// for what is accepted is the kernel's own matter (`accepted` keeps the true need where it stops writing).
// The order of pairs depends on the device: what must not, is to be sorted or reduced by order-free operations.
struct PairCounters {
    uint top;           // pairs on the stack
    uint taken;         // pairs of the present step
    uint visited;       // pairs taken so far
    uint accepted;      // counted by the kernel
    uint highest;       // the stack's highest top
    uint is_full;       // 1: not even one pair's children have room
};
#endif
