#version 460
#include "lib/prelude.glsl"
#include "lib/packed_hierarchy.glsl"

// One thread per node: the node and the shape of its leaf, as kernels over links read them.
// reads nodes, leaves   writes node_texels[HIERARCHY_TEXELS * node_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Nodes { HierarchyNode nodes[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Leaves { HierarchyLeaf leaves[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer NodeTexels { uvec4 node_texels[]; };
layout(push_constant, scalar) uniform Params { uint node_count; } params;

void main()
{
    uint i = linear_index();
    if (i >= params.node_count) return;
    HierarchyNode node = nodes[i];
    vec3 normal = vec3(0.0);
    uint flags = 0;
    if (node.shape != NONE) {
        normal = leaves[node.shape].normal;
        flags = leaves[node.shape].flags;
    }
    uint first = HIERARCHY_TEXELS * i;
    node_texels[first] = uvec4(floatBitsToUint(node.center), node.leaf);
    node_texels[first + 1] = floatBitsToUint(vec4(normal, node.area));
    node_texels[first + 2] = floatBitsToUint(vec4(node.half_u, node.radius));
    node_texels[first + 3] = uvec4(floatBitsToUint(node.half_v), flags);
    node_texels[first + 4] = uvec4(node.skip, node.shape, node.surface, floatBitsToUint(node.margin));
}
