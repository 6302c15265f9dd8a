#ifndef LIB_PACKED_HIERARCHY
#define LIB_PACKED_HIERARCHY
// Nodes of a hierarchy for kernels that read them at unrelated places, by whole texels:
//     0  centre (m), leaf (NONE for an inner node)           3  half_v (m), flags of the shape's leaf
//     1  normal of the shape (0 without one), area (m2)      4  skip, shape, surface, margin (m)
//     2  half_u (m), radius (m)
// The kernel binds `uniform usamplerBuffer node_texels`; hierarchy/pack_nodes.comp writes it.
#include "lib/hierarchy.glsl"

const uint HIERARCHY_TEXELS = 5;    // of a node

#define NODE_TEXEL(node, k) texelFetch(node_texels, int(HIERARCHY_TEXELS * (node) + (k)))
#endif
