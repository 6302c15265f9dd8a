#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/direction_bins.glsl"
#include "lib/hierarchy.glsl"

// One thread per (glossy leaf, bin of the tables' window): radiance that arrives along the bin, not far below zero.     [Dachsbacher2007 4.2 local pass]
// reads glossy_leaves[glossy_count], leaves, nodes, bin_directions, means, peaks, incident (pushed down to the parents of leaves),
// environment[BIN_COUNT], scales[2 leaf_count] (of what links bring)   writes arrived[glossy_count * BIN_COUNT] (W m^-2 sr^-1; words as the tables')   shared none
layout(local_size_x = 64) in;
layout(constant_id = 0) const uint WORDS = 2;    // of 64 bits an entry of the tables: 2 (f32) or 1 (f16)
layout(constant_id = 1) const uint BIN_COUNT = 128;
layout(set = 0, binding = 0, scalar) readonly buffer GlossyLeaves { uint glossy_leaves[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Leaves { HierarchyLeaf leaves[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Nodes { HierarchyNode nodes[]; };
layout(set = 0, binding = 3, scalar) readonly buffer BinDirections { uint64_t bin_directions[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Means { vec3 means[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Peaks { float peaks[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Incident { uint64_t incident[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Environment { vec3 environment[]; };
layout(set = 0, binding = 8, scalar) writeonly buffer Arrived { uint64_t arrived[]; };
layout(set = 0, binding = 9, scalar) readonly buffer Scales { float scales[]; };
layout(push_constant, scalar) uniform Params {
    uint glossy_count;
    uint leaf_count;
    uint node_count;
    uint first_bin;         // of the window
    uint bin_count;
    float undershoot;
    uint add_environment;   // 1: what arrives is beside the environment's own light
} params;

#include "methods/antiradiance/floor.glsl"
#include "methods/antiradiance/table.glsl"

void main()
{
    uint i = linear_index();
    if (i >= params.glossy_count * params.bin_count) return;
    uint glossy = i / params.bin_count, in_window = i % params.bin_count, bin = params.first_bin + in_window;
    uint leaf = glossy_leaves[glossy], node = leaves[leaf].node, parent = nodes[node].parent;
    // What travels against the normal arrives at the front.
    bool at_front = dot(leaves[leaf].normal, BIN_DIRECTION(bin)) <= 0.0;
    uint side = 2 * leaf + (at_front ? 0 : 1);
    vec3 value = LOAD_ENTRY(incident, entry_of(node, in_window, params.node_count));
    if (parent != NONE) value += LOAD_ENTRY(incident, entry_of(parent, in_window, params.node_count));
    if (params.add_environment != 0) value += environment[bin];
    value = max(value, lowest_of(peaks[bin * params.leaf_count + leaf], means[side], params.undershoot));
    if (params.add_environment == 0) value *= scales[side];
    STORE_ENTRY(arrived, glossy * BIN_COUNT + bin, value)
}
