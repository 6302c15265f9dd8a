#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/bins.glsl"
#include "lib/quadtree.glsl"

// One thread per leaf of a window and row of bins on a face: a bin above the horizon that nothing fills between filled
// ones is a hole in the cover of surfels, not a view of the environment. It takes the farthest of its neighbours.
// reads node_segments, segments, window_levels, receivers[leaf_count], keys   updates winners[6 n n * window leaves],
// bin after bin   shared none
// Differs from [Dong2007]: there holes stay.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer NodeSegments { uint node_segments[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Segments { QuadtreeSegment segments[]; };
layout(set = 0, binding = 2, scalar) readonly buffer WindowLevels { WindowLevel window_levels[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Receivers { Receiver receivers[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Keys { uint64_t keys[]; };
layout(set = 0, binding = 5, scalar) buffer Winners { uint winners[]; };
layout(push_constant, scalar) uniform Params {
    uint n;
    uint is_turned;     // leaves' bins are turned against their parents'
} params;

#include "methods/implicit_visibility/leaf_keys.glsl"

// The winner of the farthest of the neighbours above the horizon, across the cube's edges too; EMPTY_BIN where more than
// one of them is open for three that are filled.
uint winner_around(uint bin, vec3 normal)
{
    uint face = bin / (params.n * params.n);
    vec2 uv = in_face(face, bin_direction(bin, params.n)).xy;
    uint filled = 0, open = 0;
    uint64_t farthest = 0;
    for (uint side = 0; side < 4; ++side) {
        vec2 step_uv = side == 0 ? vec2(1, 0) : side == 1 ? vec2(-1, 0) : side == 2 ? vec2(0, 1) : vec2(0, -1);
        vec3 beside = face_direction(face, uv + 2.0 / float(params.n) * step_uv);
        if (dot(beside, normal) <= 0.0) continue;
        uint64_t other = key_of(bin_of(beside, params.n));
        if (other == NO_KEY) {
            ++open;
        } else {
            ++filled;
            farthest = max(farthest, other);
        }
    }
    return filled > 0 && open * 3 <= filled ? unpackUint2x32(farthest).x : EMPTY_BIN;
}

void main()
{
    uint i = linear_index(), leaf_count = window_levels[0].count;
    if (i >= leaf_count * 6 * params.n) return;
    uint local = i % leaf_count, bin = i / leaf_count * params.n, end = bin + params.n;
    begin_leaf(local);
    vec3 normal = turn_back(frame, receivers[window_levels[0].first + local].normal);
    while (bin < end) {
        // On to the next empty one: few are, and only there is much to do.
        bool is_empty = false;
        while (bin < end && !is_empty) {
            is_empty = winners[bin * leaf_count + local] == EMPTY_BIN && dot(bin_direction(bin, params.n), normal) > 0.0;
            ++bin;
        }
        if (is_empty) winners[(bin - 1) * leaf_count + local] = winner_around(bin - 1, normal);
    }
}
