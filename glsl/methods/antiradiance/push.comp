#version 460
#include "lib/prelude.glsl"
#include "lib/hierarchy.glsl"

// One thread per (node of one level, bin): adds what the parent received.                      [Dachsbacher2007 4.2 push]
// reads level_nodes, nodes   updates incident[node_count * bin_count] (W m^-2 sr^-1); the level above is already done   shared none
layout(local_size_x = 64) in;
layout(constant_id = 0) const uint WORDS = 3;    // of an entry of the tables: 3 (f32) or 2 (f16)
layout(set = 0, binding = 0, scalar) readonly buffer LevelNodes { uint level_nodes[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Nodes { HierarchyNode nodes[]; };
layout(set = 0, binding = 2, scalar) buffer Incident { uint incident[]; };
layout(push_constant, scalar) uniform Params { uint first; uint count; uint bin_count; } params;

#include "methods/antiradiance/table.glsl"

void main()
{
    uint i = linear_index();
    if (i >= params.count * params.bin_count) return;
    uint node = level_nodes[params.first + i / params.bin_count], bin = i % params.bin_count;
    uint from = nodes[node].parent * params.bin_count + bin, to = node * params.bin_count + bin;
    vec3 sum = LOAD_ENTRY(incident, to) + LOAD_ENTRY(incident, from);
    STORE_ENTRY(incident, to, sum);
}
