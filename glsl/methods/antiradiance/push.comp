#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/hierarchy.glsl"

// One thread per inner node of one level and few bins: adds what the parent received.       [Dachsbacher2007 4.2 push]
// reads level_nodes, nodes   updates incident[window's bins * node_count] (W m^-2 sr^-1); the level above is already done   shared none
layout(local_size_x = 64) in;
layout(constant_id = 0) const uint WORDS = 2;    // of 64 bits an entry of the tables: 2 (f32) or 1 (f16)
layout(set = 0, binding = 0, scalar) readonly buffer LevelNodes { uint level_nodes[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Nodes { HierarchyNode nodes[]; };
layout(set = 0, binding = 2, scalar) buffer Incident { uint64_t incident[]; };
layout(push_constant, scalar) uniform Params { uint first; uint count; uint node_count; } params;

#include "methods/antiradiance/table.glsl"

void main()
{
    uint i = gl_GlobalInvocationID.x, part = gl_WorkGroupID.y;
    if (i >= params.count) return;
    uint node = level_nodes[params.first + i], parent = nodes[node].parent;
    for (uint bin = part * BINS_A_THREAD; bin < (part + 1) * BINS_A_THREAD; ++bin) {
        uint to = entry_of(node, bin, params.node_count);
        vec3 sum = LOAD_ENTRY(incident, to) + LOAD_ENTRY(incident, entry_of(parent, bin, params.node_count));
        STORE_ENTRY(incident, to, sum);
    }
}
