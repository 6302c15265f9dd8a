#version 460
#include "lib/prelude.glsl"
#include "lib/hierarchy.glsl"
#include "lib/pair_queue.glsl"

// One thread per node pair of a step: a node with itself becomes all pairs of its children; two nodes become a link when
// neither is larger than a direction bin as seen from the other, or cannot be split; else the larger one is split.
//                                                                                            [Dachsbacher2007 3.2]
// reads nodes, taken_pairs   updates counters, pair_stack   writes links[capacity] (pairs of nodes, both directions)   shared none
// Differs from [Dachsbacher2007]: leaves of one flat surface are not linked, they never see each other.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Nodes { HierarchyNode nodes[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Taken { uvec2 taken_pairs[]; };
layout(set = 0, binding = 2, scalar) buffer Counters { PairCounters counters[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Stack { uvec2 pair_stack[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer Links { uvec2 links[]; };
layout(push_constant, scalar) uniform Params {
    float solid_angle;      // of a node that need not be split, sr
    uint capacity;          // links that fit; the counter goes on beyond
} params;

const float PI = 3.14159265358979;

void split_self(uint node)
{
    uint end = nodes[node].skip, children = 0, inner = 0;
    for (uint child = node + 1; child < end; child = nodes[child].skip) {
        children += 1;
        if (nodes[child].leaf == NONE) inner += 1;
    }
    uint slot = atomicAdd(counters[0].top, children * (children - 1) / 2 + inner);
    for (uint a = node + 1; a < end; a = nodes[a].skip) {
        if (nodes[a].leaf == NONE) pair_stack[slot++] = uvec2(a);
        for (uint b = nodes[a].skip; b < end; b = nodes[b].skip) pair_stack[slot++] = uvec2(a, b);
    }
}

// Replaces `node` of a pair with `other` by its children.
void split(uint node, uint other)
{
    uint end = nodes[node].skip, children = 0;
    for (uint child = node + 1; child < end; child = nodes[child].skip) children += 1;
    uint slot = atomicAdd(counters[0].top, children);
    for (uint child = node + 1; child < end; child = nodes[child].skip) pair_stack[slot++] = uvec2(child, other);
}

void main()
{
    uint i = linear_index();
    if (i >= counters[0].taken) return;

    uvec2 pair = taken_pairs[i];
    uint surface = nodes[pair.x].surface;
    if (surface != NONE && surface == nodes[pair.y].surface) return;
    if (pair.x == pair.y) {
        if (nodes[pair.x].leaf == NONE) split_self(pair.x);
        return;
    }

    // Of the sphere around everything below, at the least distance that the two may come to.
    float apart = distance(nodes[pair.x].center, nodes[pair.y].center) - nodes[pair.x].margin - nodes[pair.y].margin;
    float allowed = apart > 0.0 ? params.solid_angle * apart * apart : 0.0;
    vec2 radius = vec2(nodes[pair.x].radius, nodes[pair.y].radius);
    bvec2 must_split = bvec2(nodes[pair.x].leaf == NONE && PI * radius.x * radius.x > allowed,
                             nodes[pair.y].leaf == NONE && PI * radius.y * radius.y > allowed);
    if (!must_split.x && !must_split.y) {
        uint slot = atomicAdd(counters[0].accepted, 1);
        if (slot < params.capacity) links[slot] = pair;
    } else if (must_split.x && (!must_split.y || radius.x >= radius.y)) {
        split(pair.x, pair.y);
    } else {
        split(pair.y, pair.x);
    }
}
