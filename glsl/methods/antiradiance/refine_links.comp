#version 460
#include "lib/prelude.glsl"
#include "lib/packed_hierarchy.glsl"
#include "lib/pair_queue.glsl"

// One thread per node pair of a step, which is to be split: a node with itself into all pairs of its children, else the larger
// one. Two nodes become a link when neither is larger than a direction bin as seen from the other, or cannot be split; only what
// is to be split in turn goes back on the stack.
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
const uint MAX_CHILDREN = 4;

// What becomes of a pair of nodes.
const uint DROPPED = 0, LINKED = 1, SPLIT = 2;

struct End {
    uint node;
    vec3 center;
    float radius, margin;
    bool is_inner;
    uint skip, shape, surface;
};

End end_of(uint node)
{
    uvec4 place = NODE_TEXEL(node, 0), last = NODE_TEXEL(node, 4);
    return End(node, uintBitsToFloat(place.xyz), uintBitsToFloat(NODE_TEXEL(node, 2).w), uintBitsToFloat(last.w), place.w == NONE,
               last.x, last.y, last.z);
}

// Whether two flat nodes at rest each have the other behind a solid's surface: neither receives anything.
bool are_back_to_back(End x, End y, vec3 offset)
{
    uvec4 x_last = NODE_TEXEL(x.node, 3), y_last = NODE_TEXEL(y.node, 3);
    if (((x_last.w | y_last.w) & BLOCKS_BEHIND) != 0) return false;
    vec3 x_normal = uintBitsToFloat(NODE_TEXEL(x.node, 1).xyz), y_normal = uintBitsToFloat(NODE_TEXEL(y.node, 1).xyz);
    float cosine = dot(x_normal, y_normal), slant = sqrt(max(1.0 - cosine * cosine, 0.0));
    // How far the sphere around a flat node reaches along the other's normal.
    return dot(x_normal, offset) <= -y.radius * slant && dot(y_normal, offset) >= x.radius * slant;
}

// Whether a node must be split, `allowed` being the largest cross-section that need not: of the sphere around everything below.
bool is_large(End end, float allowed) { return end.is_inner && PI * end.radius * end.radius > allowed; }

// The largest cross-section at the least distance that the two may come to.
float allowed_between(End x, End y, vec3 offset)
{
    float apart = length(offset) - (x.margin + y.margin);
    return apart > 0.0 ? params.solid_angle * apart * apart : 0.0;
}

uint fate_of(End x, End y)
{
    if (x.surface != NONE && x.surface == y.surface) return DROPPED;
    vec3 offset = y.center - x.center;
    float allowed = allowed_between(x, y, offset);
    if (is_large(x, allowed) || is_large(y, allowed)) return SPLIT;
    bool may_be_apart = x.margin + y.margin == 0.0 && x.shape != NONE && y.shape != NONE;
    return may_be_apart && are_back_to_back(x, y, offset) ? DROPPED : LINKED;
}

void add_link(uint slot, uvec2 pair)
{
    if (slot >= params.capacity) return;
    uint part = slot / params.part_capacity, at = slot % params.part_capacity;
    if (part == 0) links[at] = pair;
    else if (part == 1) links_1[at] = pair;
    else if (part == 2) links_2[at] = pair;
    else links_3[at] = pair;
}

// The pairs of `other` with the nodes from `first` on, each where the one before ends: links, and what is to be split.
void pair_up(End other, uint first, uint end)
{
    uint nodes[MAX_CHILDREN], fates[MAX_CHILDREN], count = 0, link_count = 0, split_count = 0;
    for (uint node = first; node < end && count < MAX_CHILDREN; ++count) {
        End child = end_of(node);
        uint fate = fate_of(child, other);
        nodes[count] = node;
        fates[count] = fate;
        link_count += fate == LINKED ? 1 : 0;
        split_count += fate == SPLIT ? 1 : 0;
        node = child.skip;
    }
    uint link_slot = link_count > 0 ? atomicAdd(counters[0].accepted, link_count) : 0;
    uint split_slot = split_count > 0 ? atomicAdd(counters[0].top, split_count) : 0;
    for (uint k = 0; k < count; ++k) {
        uvec2 pair = uvec2(nodes[k], other.node);
        if (fates[k] == LINKED) add_link(link_slot++, pair);
        if (fates[k] == SPLIT) pair_stack[split_slot++] = pair;
    }
}

void main()
{
    uint i = linear_index();
    if (i >= counters[0].taken) return;
    uvec2 pair = taken_pairs[i];
    End x = end_of(pair.x);
    if (pair.x == pair.y) {
        // The children with one another, and each with itself.
        for (uint a = pair.x + 1; x.is_inner && a < x.skip;) {
            End child = end_of(a);
            if (child.is_inner) pair_stack[atomicAdd(counters[0].top, 1)] = uvec2(a);
            pair_up(child, child.skip, x.skip);
            a = child.skip;
        }
        return;
    }
    End y = end_of(pair.y);
    float allowed = allowed_between(x, y, y.center - x.center);
    bool is_x_larger = is_large(x, allowed) && (!is_large(y, allowed) || x.radius >= y.radius);
    if (x.is_inner && (is_x_larger || !y.is_inner)) pair_up(y, pair.x + 1, x.skip);
    else pair_up(x, pair.y + 1, y.skip);
}
