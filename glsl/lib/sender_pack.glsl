#ifndef LIB_SENDER_PACK
#define LIB_SENDER_PACK
// The accessor of the sender tree's nodes; the layout is said in lib/sender_tree.glsl.
#include "lib/sender_tree.glsl"

uvec4 sender_node_texel(uint i);
uvec4 sender_light_texel(uint i);

uint sender_skip(uint i) { return sender_node_texel(SENDER_NODE_TEXELS * i + 2).y; }

// Sum of the power over the channels, W.
float sender_weight(uint i) { return uintBitsToFloat(sender_light_texel(SENDER_LIGHT_TEXELS * i).w); }

// Of a node's power what it emits itself, W.
vec3 sender_emitted_power(uint i) { return uintBitsToFloat(sender_light_texel(SENDER_LIGHT_TEXELS * i + 1).xyz); }

// A leaf's own index in tree order, or that of an inner node's representative.
uint sender_leaf(uint i) { return sender_light_texel(SENDER_LIGHT_TEXELS * i + 1).w; }

SenderNode sender_node(uint i)
{
    uvec4 sphere = sender_node_texel(SENDER_NODE_TEXELS * i);
    uvec4 cone = sender_node_texel(SENDER_NODE_TEXELS * i + 1);
    uvec4 light = sender_light_texel(SENDER_LIGHT_TEXELS * i);
    return SenderNode(uintBitsToFloat(sphere.xyz), uintBitsToFloat(sphere.w), uintBitsToFloat(cone.xyz),
                      uintBitsToFloat(cone.w), sender_skip(i), uintBitsToFloat(light.xyz));
}
#endif
