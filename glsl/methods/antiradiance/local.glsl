#ifndef LOCAL
#define LOCAL
// What the kernels of the local pass share.
// The kernel declares WORDS and BIN_COUNT, binds incident, environment, peaks and exitant (the window of the tables from
// params.first_bin on), and has params.leaf_count, params.node_count, params.undershoot, params.add_environment and
// params.damping.
// A thread works through pairs of opposite bins: along one of them light arrives at the front, along the other it leaves it.

#include "lib/hemisphere.glsl"
#include "methods/antiradiance/floor.glsl"
#include "methods/antiradiance/table.glsl"

// Pairs of a thread, from part * PAIRS_A_THREAD on.
const uint PAIRS_A_THREAD = 4;
uint pairs_end(uint part) { return min((part + 1) * PAIRS_A_THREAD, BIN_COUNT / 2); }
// The part of a thread that is `index`-th of the window.
uint part_of(uint index) { return params.first_bin / (2 * PAIRS_A_THREAD) + index; }

uint window_entry(uint node, uint bin) { return entry_of(node, bin - params.first_bin, params.node_count); }

// The bin of a pair along which light arrives at the front, by the cosine of the pair's first; and the other one.
uint arriving_bin(uint pair, float cosine) { return cosine > 0.0 ? 2 * pair + 1 : 2 * pair; }
uint leaving_bin(uint pair, float cosine) { return cosine > 0.0 ? 2 * pair : 2 * pair + 1; }

// What a leaf received itself and what its ancestors did, which stands with its parent: a macro, buffers are no arguments.
#define arriving_in(node, parent, bin) (LOAD_ENTRY(incident, window_entry(node, bin)) \
    + (parent != NONE ? LOAD_ENTRY(incident, window_entry(parent, bin)) : vec3(0.0)) \
    + (params.add_environment != 0 ? environment[bin] : vec3(0.0)))

// Puts `sent` (intensity per area) into a table's entry, damped, and adds to `residual` how much that changes and how much there
// is now.
#define SEND(entry, sent, residual) { \
    vec3 before = LOAD_ENTRY(exitant, entry), after = mix(before, sent, params.damping), change = abs(after - before); \
    residual += vec2(change.r + change.g + change.b, abs(after.r) + abs(after.g) + abs(after.b)); \
    STORE_ENTRY(exitant, entry, after); }
#endif
