#version 460
#include "lib/prelude.glsl"
#include "lib/hierarchy.glsl"
#include "lib/splat.glsl"

// One thread per splat: where its leaf is now.
// reads splat_leaves[splat_count], share_offsets[splat_count + 1], leaves, nodes   writes splats[splat_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer SplatLeaves { uint splat_leaves[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Leaves { HierarchyLeaf leaves[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Nodes { HierarchyNode nodes[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Splats { Splat splats[]; };
layout(set = 0, binding = 4, scalar) readonly buffer ShareOffsets { uint share_offsets[]; };
layout(push_constant, scalar) uniform Params { uint splat_count; } params;

void main()
{
    uint i = linear_index();
    if (i >= params.splat_count) return;
    HierarchyNode node = nodes[leaves[splat_leaves[i]].node];
    splats[i] = Splat(node.center, share_offsets[i], node.half_u, share_offsets[i + 1] - share_offsets[i], node.half_v, node.surface);
}
