#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/bins.glsl"
#include "lib/quadtree.glsl"

// One thread per leaf of a window and row of bins on a face: the last step of the sweep, and the winner alone for the
// light.                                                                                      [Dong2007 4.2.3, 4.2.4]
// reads node_segments, segments, window_levels, receivers[leaf_count], keys   writes winners[6 n n * window leaves],
// bin after bin   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer NodeSegments { uint node_segments[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Segments { QuadtreeSegment segments[]; };
layout(set = 0, binding = 2, scalar) readonly buffer WindowLevels { WindowLevel window_levels[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Receivers { Receiver receivers[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Keys { uint64_t keys[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer Winners { uint winners[]; };
layout(push_constant, scalar) uniform Params {
    uint n;
    uint is_turned;     // leaves' bins are turned against their parents'
} params;

#include "methods/implicit_visibility/leaf_keys.glsl"

void main()
{
    uint i = linear_index(), leaf_count = window_levels[0].count;
    if (i >= leaf_count * 6 * params.n) return;
    uint local = i % leaf_count, first_bin = i / leaf_count * params.n;
    begin_leaf(local);
    for (uint bin = first_bin; bin < first_bin + params.n; ++bin)
        winners[bin * leaf_count + local] = unpackUint2x32(key_of(bin)).x;      // of NO_KEY: EMPTY_BIN
}
