#version 460
#include "lib/prelude.glsl"
#include "lib/bvh.glsl"

// One thread per node of a level: the bounds of its children, and the cost of its subtree.
// Runs over several small levels, deepest first, in one dispatch of one workgroup; over a large level in a dispatch of
// its own.
// reads level_first[level_count + 1], bvh_triangles (m)
// updates bvh_nodes, subtree_costs[node_count] (m2: area-weighted visits of nodes and triangles)   shared none
layout(local_size_x = 256) in;
layout(set = 0, binding = 0, scalar) readonly buffer LevelFirst     { uint level_first[]; };         // level_count + 1
layout(set = 0, binding = 1, scalar) readonly buffer Triangles      { BvhTriangle bvh_triangles[]; };// triangle_count
layout(set = 0, binding = 2, scalar) coherent buffer Nodes          { BvhNode bvh_nodes[]; };        // node_count
layout(set = 0, binding = 3, scalar) coherent buffer SubtreeCosts   { float subtree_costs[]; };      // node_count
layout(push_constant, scalar) uniform Params {
    uint deepest_level, highest_level;
} params;

void refit(uint node)
{
    float cost = 0;
    for (uint k = 0; k < 4; ++k) {
        uint child = bvh_nodes[node].child[k];
        if (child == EMPTY) continue;
        vec3 low = vec3(1e30), high = vec3(-1e30);
        float visits = 1;
        if ((child & LEAF) != 0) {
            uint first = leaf_first(child), count = leaf_count(child);
            for (uint slot = first; slot < first + count; ++slot) {
                for (uint corner = 0; corner < 3; ++corner) {
                    low = min(low, bvh_triangles[slot].corners[corner]);
                    high = max(high, bvh_triangles[slot].corners[corner]);
                }
            }
            vec3 largest = max(abs(low), abs(high));
            float slack = BVH_SLACK * max(largest.x, max(largest.y, largest.z));
            low -= slack;
            high += slack;
            visits = float(count);
        } else {
            for (uint j = 0; j < 4; ++j) {
                if (bvh_nodes[child].child[j] == EMPTY) continue;
                low = min(low, vec3(bvh_nodes[child].min_x[j], bvh_nodes[child].min_y[j], bvh_nodes[child].min_z[j]));
                high = max(high, vec3(bvh_nodes[child].max_x[j], bvh_nodes[child].max_y[j], bvh_nodes[child].max_z[j]));
            }
            cost += subtree_costs[child];
        }
        bvh_nodes[node].min_x[k] = low.x;
        bvh_nodes[node].min_y[k] = low.y;
        bvh_nodes[node].min_z[k] = low.z;
        bvh_nodes[node].max_x[k] = high.x;
        bvh_nodes[node].max_y[k] = high.y;
        bvh_nodes[node].max_z[k] = high.z;
        vec3 size = high - low;
        cost += visits * 2 * (size.x * size.y + size.y * size.z + size.z * size.x);
    }
    subtree_costs[node] = cost;
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
