#version 460
#include "lib/prelude.glsl"
#include "lib/hierarchy.glsl"
#include "lib/splat.glsl"

// One thread per splat: where its leaf is now.
// reads splat_leaves[splat_count], leaves, nodes   writes splats[splat_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer SplatLeaves { uint splat_leaves[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Leaves { HierarchyLeaf leaves[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Nodes { HierarchyNode nodes[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Splats { Splat splats[]; };
layout(push_constant, scalar) uniform Params { uint splat_count; } params;

void main()
{
    uint i = linear_index();
    if (i >= params.splat_count) return;
    HierarchyLeaf leaf = leaves[splat_leaves[i]];
    HierarchyNode node = nodes[leaf.node];
    splats[i] = Splat(node.center, leaf.element, node.half_u, leaf.back_element, node.half_v, node.surface);
}
