#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/packed_hierarchy.glsl"
#include "methods/antiradiance/solid_angle.glsl"

// One thread per link: the irradiance that a sender of radiance 1 brings to each leaf below the receiver, seen from the leaf itself,
// and how much more as the link brings it, seen from the receiver's centre; both directions.
// reads links[link_count], node_texels   updates at_leaves, excess [2 leaf_count] (front and back; 2^-18 W/m2, the excess in two's
// complement: sums of integers do not depend on their order)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Links { uvec2 links[]; };
layout(set = 0, binding = 1) uniform usamplerBuffer node_texels;     // HIERARCHY_TEXELS each
layout(set = 0, binding = 2, scalar) buffer AtLeaves { uint at_leaves[]; };
layout(set = 0, binding = 3, scalar) buffer Excess { uint excess[]; };
layout(push_constant, scalar) uniform Params { uint link_count; } params;

const float CLOSE = 16.0;           // squared distance over a rectangle's squared half sides: nearer ones are no discs
const float FIXED = 262144.0;       // 2^18
const float CLUSTER_COSINE = 0.5;   // of surfaces that look all ways, on average

// An end of a link: what of its node and shape is needed.
struct Side {
    vec3 center, normal;    // 0: without a shape
    vec3 half_u, half_v;    // of a flat one's rectangle
    float area;
    uint node, leaf, skip;
    bool is_flat, sends_behind;
};

Side side_of(uint node)
{
    uvec4 place = NODE_TEXEL(node, 0), shape = NODE_TEXEL(node, 1), last = NODE_TEXEL(node, 3), ends = NODE_TEXEL(node, 4);
    bool is_flat = ends.y != NONE;
    return Side(uintBitsToFloat(place.xyz), uintBitsToFloat(shape.xyz), uintBitsToFloat(NODE_TEXEL(node, 2).xyz),
                uintBitsToFloat(last.xyz), uintBitsToFloat(shape.w), node, place.w, ends.x, is_flat,
                !is_flat || (last.w & REFLECTS_BEHIND) != 0);
}

// Signed by the side of the leaf that it arrives at: front positive.
float irradiance_of(Side from, vec3 place, vec3 normal)
{
    vec3 offset = place - from.center;
    float squared = max(dot(offset, offset), 1e-30), height = dot(normal, offset);
    if (from.is_flat && squared < CLOSE * (dot(from.half_u, from.half_u) + dot(from.half_v, from.half_v))
        && abs(height) >= 0.999 * (abs(dot(normal, from.half_u)) + abs(dot(normal, from.half_v)))) {
        return rectangle_irradiance(offset, from.half_u, from.half_v, normal);
    }
    vec3 w = offset / sqrt(squared);
    float turned = from.is_flat ? abs(dot(from.normal, w)) : CLUSTER_COSINE;
    return -dot(normal, w) * disc_solid_angle(from.area * turned / squared);
}

uint in_fixed(float irradiance) { return uint(FIXED * abs(irradiance) + 0.5); }

void add(uint leaf, float at_leaf, float by_link)
{
    uint side = 2 * leaf + (at_leaf < 0.0 ? 1 : 0), side_by_link = 2 * leaf + (by_link < 0.0 ? 1 : 0);
    atomicAdd(at_leaves[side], in_fixed(at_leaf));
    uint less = 0u - in_fixed(at_leaf), more = in_fixed(by_link);
    if (side == side_by_link) {
        if (less + more != 0) atomicAdd(excess[side], less + more);
    } else {
        atomicAdd(excess[side], less);
        atomicAdd(excess[side_by_link], more);
    }
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
    for (uint node = to.node + 1; node < to.skip; ++node) {
        uvec4 place = NODE_TEXEL(node, 0);
        if (place.w == NONE) continue;
        vec3 normal = uintBitsToFloat(NODE_TEXEL(node, 1).xyz);
        add(place.w, irradiance_of(from, uintBitsToFloat(place.xyz), normal), irradiance_of(from, to.center, normal));
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
