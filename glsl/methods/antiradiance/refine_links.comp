#version 460
#include "lib/prelude.glsl"
#include "lib/packed_hierarchy.glsl"
#include "lib/pair_queue.glsl"

// One thread per node pair of a step: a node with itself becomes all pairs of its children; two nodes become a link when
// neither is larger than a direction bin as seen from the other, or cannot be split; else the larger one is split.
//                                                                                            [Dachsbacher2007 3.2]
// reads node_texels, taken_pairs   updates counters, pair_stack   writes links, links_1, links_2, links_3 (pairs of nodes, both
// directions, one after the other: part_capacity each)   shared none
// Differs from [Dachsbacher2007]: leaves of one flat surface are not linked, they never see each other; nor are solids back to back.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform usamplerBuffer node_texels;     // HIERARCHY_TEXELS each
layout(set = 0, binding = 1, scalar) readonly buffer Taken { uvec2 taken_pairs[]; };
layout(set = 0, binding = 2, scalar) buffer Counters { PairCounters counters[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Stack { uvec2 pair_stack[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer Links { uvec2 links[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer Links1 { uvec2 links_1[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer Links2 { uvec2 links_2[]; };
layout(set = 0, binding = 7, scalar) writeonly buffer Links3 { uvec2 links_3[]; };
layout(push_constant, scalar) uniform Params {
    float solid_angle;      // of a node that need not be split, sr
    uint capacity;          // links that fit; the counter goes on beyond
    uint part_capacity;     // of each buffer of links
} params;

const float PI = 3.14159265358979;

uint skip_of(uint node) { return NODE_TEXEL(node, 4).x; }

bool is_inner(uint node) { return NODE_TEXEL(node, 0).w == NONE; }

void split_self(uint node)
{
    uint end = skip_of(node), children = 0, inner = 0;
    for (uint child = node + 1; child < end; child = skip_of(child)) {
        children += 1;
        if (is_inner(child)) inner += 1;
    }
    uint slot = atomicAdd(counters[0].top, children * (children - 1) / 2 + inner);
    for (uint a = node + 1; a < end; a = skip_of(a)) {
        if (is_inner(a)) pair_stack[slot++] = uvec2(a);
        for (uint b = skip_of(a); b < end; b = skip_of(b)) pair_stack[slot++] = uvec2(a, b);
    }
}

// Replaces `node`, which ends at `end`, of a pair with `other` by its children.
void split(uint node, uint end, uint other)
{
    uint children = 0;
    for (uint child = node + 1; child < end; child = skip_of(child)) children += 1;
    uint slot = atomicAdd(counters[0].top, children);
    for (uint child = node + 1; child < end; child = skip_of(child)) pair_stack[slot++] = uvec2(child, other);
}

// Whether two flat nodes at rest each have the other behind a solid's surface: neither receives anything.
bool are_back_to_back(uvec2 pair, vec3 offset, vec2 radius)
{
    if (((NODE_TEXEL(pair.x, 3).w | NODE_TEXEL(pair.y, 3).w) & BLOCKS_BEHIND) != 0) return false;
    vec3 x = uintBitsToFloat(NODE_TEXEL(pair.x, 1).xyz), y = uintBitsToFloat(NODE_TEXEL(pair.y, 1).xyz);
    float cosine = dot(x, y), slant = sqrt(max(1.0 - cosine * cosine, 0.0));
    // How far the sphere around a flat node reaches along the other's normal.
    return dot(x, offset) <= -radius.y * slant && dot(y, offset) >= radius.x * slant;
}

void add_link(uint slot, uvec2 pair)
{
    uint part = slot / params.part_capacity, at = slot % params.part_capacity;
    if (part == 0) links[at] = pair;
    else if (part == 1) links_1[at] = pair;
    else if (part == 2) links_2[at] = pair;
    else links_3[at] = pair;
}

void main()
{
    uint i = linear_index();
    if (i >= counters[0].taken) return;

    uvec2 pair = taken_pairs[i];
    // skip, shape, surface, margin
    uvec4 x = NODE_TEXEL(pair.x, 4), y = NODE_TEXEL(pair.y, 4);
    if (x.z != NONE && x.z == y.z) return;
    if (pair.x == pair.y) {
        if (is_inner(pair.x)) split_self(pair.x);
        return;
    }

    // Of the sphere around everything below, at the least distance that the two may come to.
    uvec4 x_place = NODE_TEXEL(pair.x, 0), y_place = NODE_TEXEL(pair.y, 0);     // centre, leaf
    vec3 offset = uintBitsToFloat(y_place.xyz) - uintBitsToFloat(x_place.xyz);
    vec2 radius = uintBitsToFloat(uvec2(NODE_TEXEL(pair.x, 2).w, NODE_TEXEL(pair.y, 2).w));
    float margin = uintBitsToFloat(x.w) + uintBitsToFloat(y.w), apart = length(offset) - margin;
    float allowed = apart > 0.0 ? params.solid_angle * apart * apart : 0.0;
    bvec2 must_split = bvec2(x_place.w == NONE && PI * radius.x * radius.x > allowed,
                             y_place.w == NONE && PI * radius.y * radius.y > allowed);
    if (!must_split.x && !must_split.y) {
        if (margin == 0.0 && x.y != NONE && y.y != NONE && are_back_to_back(pair, offset, radius)) return;
        uint slot = atomicAdd(counters[0].accepted, 1);
        if (slot < params.capacity) add_link(slot, pair);
    } else if (must_split.x && (!must_split.y || radius.x >= radius.y)) {
        split(pair.x, x.x, pair.y);
    } else {
        split(pair.y, y.x, pair.x);
    }
}
