#version 460
#include "lib/prelude.glsl"
#include "lib/hierarchy.glsl"

// One thread per leaf: hands the irradiance of its sides to the elements that the display reads.
// reads leaves, leaf_irradiance[2 leaf_count] (W/m2)   writes irradiance[element_count] (W/m2)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Leaves { HierarchyLeaf leaves[]; };
layout(set = 0, binding = 1, scalar) readonly buffer LeafIrradiance { vec3 leaf_irradiance[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Irradiance { vec3 irradiance[]; };
layout(push_constant, scalar) uniform Params { uint leaf_count; } params;

void main()
{
    uint leaf = linear_index();
    if (leaf >= params.leaf_count) return;
    // Deep shadow may come out a little below zero: two sums of one size were subtracted.
    irradiance[leaves[leaf].element] = max(leaf_irradiance[2 * leaf], vec3(0.0));
    uint back = leaves[leaf].back_element;
    if (back != NONE) irradiance[back] = max(leaf_irradiance[2 * leaf + 1], vec3(0.0));
}
