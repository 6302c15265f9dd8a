#ifndef LIB_SENDER_LEAF
#define LIB_SENDER_LEAF
// The accessor of the sender tree's leaves: shape and light, in texels.
//
// Bridge of what reads leaves:
//     uvec4 sender_leaf_texel(uint i)       SENDER_LEAF_TEXELS each
#include "lib/sender_tree.glsl"

// Of a leaf: centre | is_triangle in bit 0, the row of its table of lobes above that (lib/sender_gloss.glsl); edge_u | edge_v x; edge_v yz | emitted rg; emitted b | reflected.
const uint SENDER_LEAF_TEXELS = 4;

uvec4 sender_leaf_texel(uint i);

SenderLeaf sender_shape(uint slot)
{
    uvec4 a = sender_leaf_texel(SENDER_LEAF_TEXELS * slot), b = sender_leaf_texel(SENDER_LEAF_TEXELS * slot + 1);
    uvec4 c = sender_leaf_texel(SENDER_LEAF_TEXELS * slot + 2);
    return SenderLeaf(uintBitsToFloat(a.xyz), uintBitsToFloat(b.xyz), uintBitsToFloat(uvec3(b.w, c.xy)), a.w & 1);
}

LeafLight sender_leaf_light(uint slot)
{
    uvec4 c = sender_leaf_texel(SENDER_LEAF_TEXELS * slot + 2), d = sender_leaf_texel(SENDER_LEAF_TEXELS * slot + 3);
    return LeafLight(uintBitsToFloat(uvec3(c.zw, d.x)), uintBitsToFloat(d.yzw));
}
#endif
