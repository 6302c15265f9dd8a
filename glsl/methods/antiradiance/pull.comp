#version 460
#include "lib/prelude.glsl"
#include "lib/hierarchy.glsl"

// One thread per (node of one level, bin): an inner node's exitant intensity per area from its children's.
//                                                                                               [Dachsbacher2007 4.2 pull]
// reads level_nodes, nodes   updates exitant[node_count * bin_count] (W m^-2 sr^-1); the level below is already done   shared none
// Differs from [Dachsbacher2007]: per area, a mean in place of a sum, so that f16 has digits for small and large nodes alike.
layout(local_size_x = 64) in;
layout(constant_id = 0) const uint WORDS = 3;    // of an entry of the tables: 3 (f32) or 2 (f16)
layout(set = 0, binding = 0, scalar) readonly buffer LevelNodes { uint level_nodes[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Nodes { HierarchyNode nodes[]; };
layout(set = 0, binding = 2, scalar) buffer Exitant { uint exitant[]; };
layout(push_constant, scalar) uniform Params { uint first; uint count; uint bin_count; } params;

#include "methods/antiradiance/table.glsl"

void main()
{
    uint i = linear_index();
    if (i >= params.count * params.bin_count) return;
    uint node = level_nodes[params.first + i / params.bin_count], bin = i % params.bin_count;
    if (nodes[node].leaf != NONE) return;

    vec3 sum = vec3(0.0);
    float area = 0.0;
    uint end = nodes[node].skip;
    for (uint child = node + 1; child < end; child = nodes[child].skip) {
        sum += nodes[child].area * LOAD_ENTRY(exitant, child * params.bin_count + bin);
        area += nodes[child].area;
    }
    vec3 mean = area > 0.0 ? sum / area : vec3(0.0);
    STORE_ENTRY(exitant, node * params.bin_count + bin, mean);
}
