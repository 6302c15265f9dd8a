#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/hierarchy.glsl"

// One thread per (inner node of one level, bin): exitant intensity per area from the children's.
//                                                                                               [Dachsbacher2007 4.2 pull]
// reads level_nodes, nodes   updates exitant[node_count * BIN_COUNT] (W m^-2 sr^-1); the level below is already done   shared none
// Differs from [Dachsbacher2007]: per area, a mean in place of a sum, so that f16 has digits for small and large nodes alike.
layout(local_size_x = 64) in;
layout(constant_id = 0) const uint WORDS = 2;    // of 64 bits an entry of the tables: 2 (f32) or 1 (f16)
layout(constant_id = 1) const uint BIN_COUNT = 128;
layout(set = 0, binding = 0, scalar) readonly buffer LevelNodes { uint level_nodes[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Nodes { HierarchyNode nodes[]; };
layout(set = 0, binding = 2, scalar) buffer Exitant { uint64_t exitant[]; };
layout(push_constant, scalar) uniform Params { uint first; uint count; } params;

#include "methods/antiradiance/table.glsl"

void main()
{
    uint i = linear_index();
    if (i >= params.count * BIN_COUNT) return;
    uint node = level_nodes[params.first + i / BIN_COUNT], bin = i % BIN_COUNT;

    vec3 sum = vec3(0.0);
    float area = 0.0;
    uint end = nodes[node].skip;
    for (uint child = node + 1; child < end; child = nodes[child].skip) {
        sum += nodes[child].area * LOAD_ENTRY(exitant, child * BIN_COUNT + bin);
        area += nodes[child].area;
    }
    vec3 mean = area > 0.0 ? sum / area : vec3(0.0);
    STORE_ENTRY(exitant, node * BIN_COUNT + bin, mean);
}
