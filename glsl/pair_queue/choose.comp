#version 460
#include "lib/prelude.glsl"
#include "lib/pair_queue.glsl"

// One thread: how many pairs the next step takes from the top of the stack, so that all they can be refined into has room.
// updates counters[1]   writes thread_counts[1] (of the take and the step)   shared none
layout(local_size_x = 1) in;
layout(set = 0, binding = 0, scalar) buffer Counters { PairCounters counters[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer ThreadCounts { uint thread_counts[]; };
layout(push_constant, scalar) uniform Params {
    uint batch;             // pairs of a step, at most
    uint capacity;          // pairs of the stack
    uint max_children;      // pairs that one pair is refined into, at most
} params;

void main()
{
    uint top = counters[0].top;
    uint growth = max(params.max_children, 1u) - 1;     // of the stack, per pair taken
    uint taken = min(top, params.batch);
    if (growth > 0) {
        // Half of the room, so that the next steps have some too; the last bit for single pairs.
        uint room = params.capacity - top;
        taken = min(taken, max(room / 2 / growth, room >= growth ? 1u : 0u));
    }
    counters[0].top = top - taken;
    counters[0].taken = taken;
    counters[0].visited += taken;
    counters[0].highest = max(counters[0].highest, top);
    if (taken == 0 && top > 0) counters[0].is_full = 1;
    thread_counts[0] = taken;
}
