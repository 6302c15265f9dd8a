#version 460
#include "lib/prelude.glsl"
#include "lib/hierarchy.glsl"

// One thread per leaf: how much its exitant light changed in this step, how much there is, and how much of it is reflected and
// emitted.
// reads residual_parts[part_count * leaf_count], light_changes[leaf_count] (W), leaves, radiosity[2 leaf_count] (W/m2)   writes residuals[leaf_count] (W)
// shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer ResidualParts { vec2 residual_parts[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Leaves { HierarchyLeaf leaves[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Radiosity { vec3 radiosity[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Residuals { vec3 residuals[]; };
layout(set = 0, binding = 4, scalar) readonly buffer LightChanges { vec2 light_changes[]; };
layout(push_constant, scalar) uniform Params { uint leaf_count; uint part_count; } params;

void main()
{
    uint leaf = linear_index();
    if (leaf >= params.leaf_count) return;
    vec2 residual = light_changes[leaf];
    for (uint part = 0; part < params.part_count; ++part) residual += residual_parts[part * params.leaf_count + leaf];
    vec3 sent = radiosity[2 * leaf] + radiosity[2 * leaf + 1];
    residuals[leaf] = vec3(residual, leaves[leaf].area * (sent.r + sent.g + sent.b));
}
