#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/bins.glsl"
#include "lib/quadtree.glsl"

// One thread per leaf of a window and row of bins on a face: the last step of the sweep, and the winner alone for the light. A bin
// that nothing fills between filled ones is a hole in the cover of surfels, not a view of the environment: it takes the
// farthest of its neighbours.                                                                [Dong2007 4.2.3, 4.2.4]
// reads node_segments, segments, window_levels, receivers[leaf_count], keys   writes winners[6 n n * window leaves],
// bin after bin   shared none
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
    uint is_turned;     // leaves' bins are turned against their parents'
} params;

const uint64_t NO_KEY = ~uint64_t(0);

uint own_row;
uint parent_row;
bool has_parent;
vec4 frame;

// The nearest of the leaf's own link and its parent's in the same direction.
uint64_t key_of(uint bin)
{
    uint bin_count = 6 * params.n * params.n;
    uint64_t key = keys[own_row * bin_count + bin];
    if (!has_parent) return key;
    uint parent_bin = params.is_turned == 0 ? bin : bin_of(turn(frame, bin_direction(bin, params.n)), params.n);
    return min(key, keys[parent_row * bin_count + parent_bin]);
}

// The bin's winner; a hole takes that of the farthest of its neighbours above the horizon, across the cube's edges too.
uint64_t filled_key(uint bin, vec3 normal)
{
    uint64_t key = key_of(bin);
    vec3 direction = bin_direction(bin, params.n);
    if (key != NO_KEY || params.fills_holes == 0 || dot(direction, normal) <= 0.0) return key;
    uint face = bin / (params.n * params.n);
    vec2 uv = in_face(face, direction).xy;
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
    return filled > 0 && open * 3 <= filled ? farthest : key;
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
    has_parent = segment.parent_first != NO_PARENT && parent >= above.first && parent - above.first < above.count;
    parent_row = above.row + parent - above.first;
    frame = receivers[leaf].frame;
    vec3 normal = turn_back(frame, receivers[leaf].normal);

    for (uint bin = first_bin; bin < first_bin + params.n; ++bin) {
        uint64_t key = filled_key(bin, normal);
        winners[bin * own.count + local] = key == NO_KEY ? EMPTY_BIN : unpackUint2x32(key).x;
    }
}
