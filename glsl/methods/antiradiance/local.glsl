#ifndef LOCAL
#define LOCAL
// What the kernels of the local pass share.
// The kernel declares WORDS and BIN_COUNT, binds incident and environment, and has params.node_count and
// params.add_environment.

const float PI = 3.14159265358979;
#include "methods/antiradiance/table.glsl"

// What a leaf received itself and what its ancestors did, which stands with its parent: a macro, buffers are no arguments.
#define arriving_in(node, parent, bin) (LOAD_ENTRY(incident, entry_of(node, bin, params.node_count)) \
    + (parent != NONE ? LOAD_ENTRY(incident, entry_of(parent, bin, params.node_count)) : vec3(0.0)) \
    + (params.add_environment != 0 ? environment[bin] : vec3(0.0)))
#endif
