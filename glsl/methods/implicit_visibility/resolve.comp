#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/bins.glsl"
#include "lib/quadtree.glsl"

// One thread per leaf of a window and row of bins on a face: the last step of the sweep, and the winner alone for the light. A bin
// above the horizon that nothing fills between filled ones is a hole in the cover of surfels, not a view of the
// environment: it takes the farthest of its neighbours.                                      [Dong2007 4.2.3, 4.2.4]
// reads node_segments, segments, window_levels, receivers[leaf_count], keys   updates winners[6 n n * window leaves],
// bin after bin (empty before: bins below the horizon stay so)   shared none
// Differs from [Dong2007]: holes are filled.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer NodeSegments { uint node_segments[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Segments { QuadtreeSegment segments[]; };
layout(set = 0, binding = 2, scalar) readonly buffer WindowLevels { WindowLevel window_levels[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Receivers { Receiver receivers[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Keys { uint64_t keys[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer Winners { uint winners[]; };
layout(push_constant, scalar) uniform Params {
    uint n;
    uint fills_holes;
} params;
// 1: leaves' bins are turned against their parents'.
layout(constant_id = 0) const uint IS_TURNED = 0;

const uint64_t NO_KEY = ~uint64_t(0);

uint own_row;
uint parent_row;        // its own where no parent receives
vec4 frame;

// The nearest of the leaf's own link and its parent's in the same direction.
uint64_t key_of(uint bin)
{
    uint bin_count = 6 * params.n * params.n, parent_bin = bin;
    if (IS_TURNED != 0 && parent_row != own_row) parent_bin = bin_of(turn(frame, bin_direction(bin, params.n)), params.n);
    return min(keys[own_row * bin_count + bin], keys[parent_row * bin_count + parent_bin]);
}

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
    WindowLevel own = window_levels[0], above = window_levels[1];
    uint i = linear_index();
    if (i >= own.count * 6 * params.n) return;
    uint local = i % own.count, first_bin = i / own.count * params.n;
    uint leaf = own.first + local;
    QuadtreeSegment segment = segments[node_segments[leaf]];
    own_row = own.row + local;
    uint parent = segment.parent_first == NO_PARENT ? 0 : quadtree_parent(segment, leaf);
    bool has_parent = segment.parent_first != NO_PARENT && parent >= above.first && parent - above.first < above.count;
    parent_row = has_parent ? above.row + parent - above.first : own_row;
    frame = receivers[leaf].frame;
    vec3 normal = turn_back(frame, receivers[leaf].normal);
    uint face = i / own.count / params.n, row = i / own.count % params.n;

    // At most 64 bins; those that are empty come second, together: few are, and only there is much to do.
    uvec2 empty = uvec2(0);
    for (uint k = 0; k < params.n; ++k) {
        vec2 uv = vec2(cell_centre(k, params.n), cell_centre(row, params.n));
        if (is_below(face, uv, normal, params.n)) continue;
        uint64_t key = key_of(first_bin + k);
        winners[(first_bin + k) * own.count + local] = unpackUint2x32(key).x;       // of NO_KEY: EMPTY_BIN
        bool is_seen = dot(face_direction(face, uv), normal) > 0.0;
        uint bit = key == NO_KEY && is_seen ? params.fills_holes << (k & 31) : 0u;
        empty |= k < 32 ? uvec2(bit, 0) : uvec2(0, bit);
    }
    while (empty != uvec2(0)) {
        uint k = empty.x != 0 ? uint(findLSB(empty.x)) : 32 + uint(findLSB(empty.y));
        empty &= k < 32 ? uvec2(~(1u << k), ~0u) : uvec2(~0u, ~(1u << (k - 32)));
        winners[(first_bin + k) * own.count + local] = winner_around(first_bin + k, normal);
    }
}
