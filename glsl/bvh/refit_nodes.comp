#version 460
#include "lib/prelude.glsl"
#include "lib/bvh_pack.glsl"

// One thread per node of a level: its bounds, its children's bounds in its grid, and the cost of its subtree.
// Runs over several small levels, deepest first, in one dispatch of one workgroup; over a large level in a dispatch of
// its own.
// reads level_first[level_count + 1], triangle_texels (m)
// updates node_texels, node_bounds[node_count] (m), subtree_costs[node_count] (m2: area-weighted visits)   shared none
layout(local_size_x = 256) in;
layout(set = 0, binding = 0, scalar) readonly buffer LevelFirst { uint level_first[]; };      // level_count + 1
layout(set = 0, binding = 1, scalar) readonly buffer Triangles  { uvec4 triangle_texels[]; }; // TRIANGLE_TEXELS each
layout(set = 0, binding = 2, scalar) buffer Nodes               { uvec4 node_texels[]; };     // NODE_TEXELS each
layout(set = 0, binding = 3, scalar) coherent buffer Bounds     { BvhBounds node_bounds[]; }; // node_count
layout(set = 0, binding = 4, scalar) coherent buffer Costs      { float subtree_costs[]; };   // node_count
layout(push_constant, scalar) uniform Params {
    uint deepest_level, highest_level;
} params;

BvhBounds leaf_bounds(uint first, uint count)
{
    vec3 low = vec3(1e30), high = vec3(-1e30);
    for (uint slot = first; slot < first + count; ++slot) {
        uvec4 texel0 = triangle_texels[TRIANGLE_TEXELS * slot], texel1 = triangle_texels[TRIANGLE_TEXELS * slot + 1];
        vec3 a = uintBitsToFloat(texel0.xyz);
        vec3 b = uintBitsToFloat(uvec3(texel0.w, texel1.xy));
        vec3 c = uintBitsToFloat(uvec3(texel1.zw, triangle_texels[TRIANGLE_TEXELS * slot + 2].x));
        low = min(low, min(a, min(b, c)));
        high = max(high, max(a, max(b, c)));
    }
    vec3 largest = max(abs(low), abs(high));
    float slack = BVH_SLACK * max(largest.x, max(largest.y, largest.z));
    return BvhBounds(low - slack, high + slack);
}

// Exponent bits of the least power of two that spans `extent` in 255 cells.
uint grid_exponent(float extent) { return clamp(floatBitsToUint(extent / 255) + 0x7fffffu >> 23, 1u, 254u); }

void refit(uint node)
{
    uint word = node_texels[NODE_TEXELS * node].w;
    uint first_child = node_texels[NODE_TEXELS * node + 2].z, slot = node_texels[NODE_TEXELS * node + 2].w;
    BvhBounds children[4];
    BvhBounds all = BvhBounds(vec3(1e30), vec3(-1e30));
    float cost = 0;
    [[unroll]] for (uint k = 0; k < 4; ++k) {
        uint kind = child_kind(word, k);
        if (kind == 0) continue;
        float visits = 1;
        if (kind == KIND_INNER) {
            children[k] = node_bounds[first_child + k];
            cost += subtree_costs[first_child + k];
        } else {
            children[k] = leaf_bounds(slot, kind);
            slot += kind;
            visits = float(kind);
        }
        all = BvhBounds(min(all.low, children[k].low), max(all.high, children[k].high));
        vec3 size = children[k].high - children[k].low;
        cost += visits * 2 * (size.x * size.y + size.y * size.z + size.z * size.x);
    }
    node_bounds[node] = all;
    subtree_costs[node] = cost;

    // Round the children's bounds outwards to the grid.
    vec3 extent = max(all.high - all.low, vec3(0));
    word = word & 0xff000000u | grid_exponent(extent.x) | grid_exponent(extent.y) << 8 | grid_exponent(extent.z) << 16;
    vec3 cell = grid_cell(word);
    uvec3 lows = uvec3(0), highs = uvec3(0);
    [[unroll]] for (uint k = 0; k < 4; ++k) {
        if (child_kind(word, k) == 0) continue;
        lows |= uvec3(clamp(floor((children[k].low - all.low) / cell), 0, 255)) << 8 * k;
        highs |= uvec3(clamp(ceil((children[k].high - all.low) / cell), 0, 255)) << 8 * k;
    }
    node_texels[NODE_TEXELS * node] = uvec4(floatBitsToUint(all.low), word);
    node_texels[NODE_TEXELS * node + 1] = uvec4(lows.x, highs.x, lows.y, highs.y);
    node_texels[NODE_TEXELS * node + 2].xy = uvec2(lows.z, highs.z);
}

void main()
{
    for (uint level = params.deepest_level + 1; level-- > params.highest_level;) {
        uint last = level_first[level + 1];
        uint thread_count = gl_NumWorkGroups.x * gl_NumWorkGroups.y * gl_WorkGroupSize.x;
        for (uint node = level_first[level] + linear_index(); node < last; node += thread_count) refit(node);
        memoryBarrierBuffer();
        barrier();
    }
}
