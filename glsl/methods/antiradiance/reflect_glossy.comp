#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/hierarchy.glsl"
#include "lib/leaf_gloss.glsl"

// One thread per (glossy leaf, bin): radiance that its specular lobe sends along the bin.  [Dachsbacher2007 4.2 local pass, Eq. 18]
// reads glossy_leaves[glossy_count], leaves, nodes, gloss, cosine_norms, bin_directions, means, peaks, incident (pushed down to the
// parents of leaves), environment[BIN_COUNT], base[glossy_count * BIN_COUNT] (what is sent in any case)   writes specular[glossy_count * BIN_COUNT] (W m^-2 sr^-1)   shared none
layout(local_size_x = 64) in;
layout(constant_id = 0) const uint WORDS = 2;    // of 64 bits an entry of the tables: 2 (f32) or 1 (f16)
layout(constant_id = 1) const uint BIN_COUNT = 128;
layout(set = 0, binding = 0, scalar) readonly buffer GlossyLeaves { uint glossy_leaves[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Leaves { HierarchyLeaf leaves[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Nodes { HierarchyNode nodes[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Gloss { LeafGloss gloss[]; };
layout(set = 0, binding = 4, scalar) readonly buffer CosineNorms { float cosine_norms[]; };
layout(set = 0, binding = 5, scalar) readonly buffer BinDirections { uint64_t bin_directions[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Means { vec3 means[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Incident { uint64_t incident[]; };
layout(set = 0, binding = 8, scalar) writeonly buffer Specular { vec3 specular[]; };
layout(set = 0, binding = 9, scalar) readonly buffer Base { vec3 base[]; };
layout(set = 0, binding = 10, scalar) readonly buffer Environment { vec3 environment[]; };
layout(set = 0, binding = 11, scalar) readonly buffer Peaks { float peaks[]; };
layout(push_constant, scalar) uniform Params {
    uint glossy_count;
    uint leaf_count;
    uint node_count;
    float undershoot;
    uint add_environment;   // 1: what arrives is beside the environment's own light
} params;

vec3 beside(uint bin) { return params.add_environment != 0 ? environment[bin] : vec3(0.0); }

#include "methods/antiradiance/gloss.glsl"

void main()
{
    uint i = linear_index();
    if (i >= params.glossy_count * BIN_COUNT) return;
    specular[i] = base[i] + glossy_radiance(glossy_leaves[i / BIN_COUNT], BIN_DIRECTION(i % BIN_COUNT, BIN_COUNT));
}
