#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/hierarchy.glsl"
#include "methods/antiradiance/solid_angle.glsl"

// One thread per link and direction: the irradiance that a sender of radiance 1 brings to each leaf below the receiver, seen from
// the leaf itself, and as the link brings it: seen from the receiver's centre.
// reads links[link_count], nodes, leaves   updates at_leaves, by_links [2 leaf_count] (front and back; 2^-18 W/m2: sums of
// integers do not depend on their order)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Links { uvec2 links[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Nodes { HierarchyNode nodes[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Leaves { HierarchyLeaf leaves[]; };
layout(set = 0, binding = 3, scalar) buffer AtLeaves { uint at_leaves[]; };
layout(set = 0, binding = 4, scalar) buffer ByLinks { uint by_links[]; };
layout(push_constant, scalar) uniform Params { uint link_count; } params;

const float FIXED = 262144.0;       // 2^18
const float CLUSTER_COSINE = 0.5;   // of surfaces that look all ways, on average

void main()
{
    uint i = linear_index();
    if (i >= 2 * params.link_count) return;
    uvec2 link = links[i / 2];
    uint sender = i % 2 == 0 ? link.x : link.y, receiver = i % 2 == 0 ? link.y : link.x;
    vec3 from = nodes[sender].center, offset = nodes[receiver].center - from;
    float area = nodes[sender].area, squared = dot(offset, offset);
    uint shape = nodes[sender].shape;
    vec3 sender_normal = shape == NONE ? vec3(0.0) : leaves[shape].normal;
    // What looks away sends no light.
    if (!(squared > 0.0)
        || (shape != NONE && dot(sender_normal, offset) <= 0.0 && (leaves[shape].flags & REFLECTS_BEHIND) == 0)) return;
    vec3 w = offset / sqrt(squared);
    float by_link = disc_solid_angle(area * (shape == NONE ? CLUSTER_COSINE : abs(dot(sender_normal, w))) / squared);

    uint end = nodes[receiver].skip;
    for (uint node = receiver; node < end; ++node) {
        uint leaf = nodes[node].leaf;
        if (leaf == NONE) continue;
        vec3 normal = leaves[leaf].normal, own_offset = nodes[node].center - from;
        float own_squared = max(dot(own_offset, own_offset), 1e-30), cosine = dot(normal, w);
        vec3 own_w = own_offset / sqrt(own_squared);
        float own_cosine = dot(normal, own_w);
        float at_leaf = disc_solid_angle(area * (shape == NONE ? CLUSTER_COSINE : abs(dot(sender_normal, own_w))) / own_squared);
        atomicAdd(by_links[2 * leaf + (cosine > 0.0 ? 1 : 0)], uint(FIXED * abs(cosine) * by_link + 0.5));
        atomicAdd(at_leaves[2 * leaf + (own_cosine > 0.0 ? 1 : 0)], uint(FIXED * abs(own_cosine) * at_leaf + 0.5));
    }
}
