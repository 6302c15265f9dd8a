#ifndef LOCAL
#define LOCAL
// What the kernels of the local pass share.
// The kernel declares WORDS and BIN_COUNT, binds incident, environment and exitant, and has params.node_count,
// params.add_environment and params.damping.

const float PI = 3.14159265358979;
#include "methods/antiradiance/table.glsl"

// What a leaf received itself and what its ancestors did, which stands with its parent: a macro, buffers are no arguments.
#define arriving_in(node, parent, bin) (LOAD_ENTRY(incident, entry_of(node, bin, params.node_count)) \
    + (parent != NONE ? LOAD_ENTRY(incident, entry_of(parent, bin, params.node_count)) : vec3(0.0)) \
    + (params.add_environment != 0 ? environment[bin] : vec3(0.0)))

// Puts `sent` (intensity per area) into a table's entry, damped, and adds to `residual` how much that changes and how much there
// is now.
#define SEND(entry, sent, residual) { \
    vec3 before = LOAD_ENTRY(exitant, entry), after = mix(before, sent, params.damping), change = abs(after - before); \
    residual += vec2(change.r + change.g + change.b, abs(after.r) + abs(after.g) + abs(after.b)); \
    STORE_ENTRY(exitant, entry, after); }
#endif
