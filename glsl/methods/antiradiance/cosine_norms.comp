#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/direction_bins.glsl"
#include "lib/hierarchy.glsl"

// One thread per leaf: what its cosines are scaled by so that they sum to pi over either side's bins: a leaf then neither
// makes nor loses energy.
// reads leaves[leaf_count], bin_directions[bin_count]   writes cosine_norms[leaf_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Leaves { HierarchyLeaf leaves[]; };
layout(set = 0, binding = 1, scalar) readonly buffer BinDirections { uint64_t bin_directions[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer CosineNorms { float cosine_norms[]; };
layout(push_constant, scalar) uniform Params { uint leaf_count; uint bin_count; } params;

void main()
{
    uint leaf = linear_index();
    if (leaf >= params.leaf_count) return;
    vec3 normal = leaves[leaf].normal;
    float sum = 0.0;
    // Either side has the same sum: bins come in opposite pairs.
    for (uint bin = 0; bin < params.bin_count; ++bin)
        sum += discrete_cosine(dot(normal, BIN_DIRECTION(bin)), 1.0, params.bin_count);
    cosine_norms[leaf] = float(params.bin_count) / (2.0 * sum);
}
