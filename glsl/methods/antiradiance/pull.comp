#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/hierarchy.glsl"

// One thread per inner node of one level and few bins: exitant intensity per area from the children's.
//                                                                                               [Dachsbacher2007 4.2 pull]
// reads level_nodes, nodes   updates exitant[window's bins * node_count] (W m^-2 sr^-1); the level below is already done   shared none
// Differs from [Dachsbacher2007]: per area, a mean in place of a sum, so that f16 has digits for small and large nodes alike.
layout(local_size_x = 64) in;
layout(constant_id = 0) const uint WORDS = 2;    // of 64 bits an entry of the tables: 2 (f32) or 1 (f16)
layout(set = 0, binding = 0, scalar) readonly buffer LevelNodes { uint level_nodes[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Nodes { HierarchyNode nodes[]; };
layout(set = 0, binding = 2, scalar) buffer Exitant { uint64_t exitant[]; };
layout(push_constant, scalar) uniform Params { uint first; uint count; uint node_count; } params;

#include "methods/antiradiance/table.glsl"

const uint MAX_CHILDREN = 4;

void main()
{
    uint i = gl_GlobalInvocationID.x, part = gl_WorkGroupID.y;
    if (i >= params.count) return;
    uint node = level_nodes[params.first + i];

    // A missing child is the first one, of no weight.
    uint end = nodes[node].skip, child = node + 1;
    uvec4 children = uvec4(child);
    vec4 weights = vec4(0.0);
    for (uint k = 0; k < MAX_CHILDREN && child < end; ++k) {
        children[k] = child;
        weights[k] = nodes[child].area;
        child = nodes[child].skip;
    }
    float area = weights.x + weights.y + weights.z + weights.w;
    if (area > 0.0) weights /= area;

    for (uint bin = part * BINS_A_THREAD; bin < (part + 1) * BINS_A_THREAD; ++bin) {
        uvec4 entries = children + bin * params.node_count;
        vec3 mean = weights.x * LOAD_ENTRY(exitant, entries.x) + weights.y * LOAD_ENTRY(exitant, entries.y)
                    + weights.z * LOAD_ENTRY(exitant, entries.z) + weights.w * LOAD_ENTRY(exitant, entries.w);
        STORE_ENTRY(exitant, entry_of(node, bin, params.node_count), mean);
    }
}
