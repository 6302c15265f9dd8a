#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/hierarchy.glsl"
#include "methods/antiradiance/solid_angle.glsl"

// One thread per link: the irradiance that a sender of radiance 1 brings to each leaf below the receiver, seen from the leaf itself,
// and how much more as the link brings it, seen from the receiver's centre; both directions.
// reads links[link_count], nodes, leaves   updates at_leaves, excess [2 leaf_count] (front and back; 2^-18 W/m2, the excess in two's
// complement: sums of integers do not depend on their order)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Links { uvec2 links[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Nodes { HierarchyNode nodes[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Leaves { HierarchyLeaf leaves[]; };
layout(set = 0, binding = 3, scalar) buffer AtLeaves { uint at_leaves[]; };
layout(set = 0, binding = 4, scalar) buffer Excess { uint excess[]; };
layout(push_constant, scalar) uniform Params { uint link_count; } params;

const float FIXED = 262144.0;       // 2^18
const float CLUSTER_COSINE = 0.5;   // of surfaces that look all ways, on average

// An end of a link: what of its node and shape is needed.
struct Side {
    vec3 center, normal;
    float area;
    uint node, leaf, shape;
    bool sends_behind;
};

Side side_of(uint node)
{
    uint shape = nodes[node].shape;
    Side side = Side(nodes[node].center, vec3(0.0), nodes[node].area, node, nodes[node].leaf, shape, true);
    if (shape != NONE) {
        side.normal = leaves[shape].normal;
        side.sends_behind = (leaves[shape].flags & REFLECTS_BEHIND) != 0;
    }
    return side;
}

// Signed by the side of the leaf that it arrives at: front positive.
float irradiance_of(Side from, vec3 place, vec3 normal)
{
    vec3 offset = place - from.center;
    float squared = max(dot(offset, offset), 1e-30);
    vec3 w = offset / sqrt(squared);
    float turned = from.shape == NONE ? CLUSTER_COSINE : abs(dot(from.normal, w));
    return -dot(normal, w) * disc_solid_angle(from.area * turned / squared);
}

uint in_fixed(float irradiance) { return uint(FIXED * abs(irradiance) + 0.5); }

void add(uint leaf, float at_leaf, float by_link)
{
    atomicAdd(at_leaves[2 * leaf + (at_leaf < 0.0 ? 1 : 0)], in_fixed(at_leaf));
    if (at_leaf == by_link) return;
    atomicAdd(excess[2 * leaf + (by_link < 0.0 ? 1 : 0)], in_fixed(by_link));
    atomicAdd(excess[2 * leaf + (at_leaf < 0.0 ? 1 : 0)], 0u - in_fixed(at_leaf));
}

void bring(Side from, Side to)
{
    vec3 offset = to.center - from.center;
    // What looks away sends no light.
    if (dot(offset, offset) <= 0.0 || (!from.sends_behind && dot(from.normal, offset) <= 0.0)) return;
    if (to.leaf != NONE) {
        float own = irradiance_of(from, to.center, to.normal);
        add(to.leaf, own, own);
        return;
    }
    uint end = nodes[to.node].skip;
    for (uint node = to.node + 1; node < end; ++node) {
        uint leaf = nodes[node].leaf;
        if (leaf == NONE) continue;
        vec3 normal = leaves[leaf].normal;
        add(leaf, irradiance_of(from, nodes[node].center, normal), irradiance_of(from, to.center, normal));
    }
}

void main()
{
    uint i = linear_index();
    if (i >= params.link_count) return;
    uvec2 link = links[i];
    Side x = side_of(link.x), y = side_of(link.y);
    bring(x, y);
    bring(y, x);
}
