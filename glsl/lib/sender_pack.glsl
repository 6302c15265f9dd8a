#ifndef LIB_SENDER_PACK
#define LIB_SENDER_PACK
// The accessor of the sender tree's nodes: wide, in texels of floats, or compact, the paper's 128 bits in one texel.
//                                                                                             [Ritschel2008 4.2.1]
// Compact, low bits first: centre 3 x 8, radius 8 | normal 3 x 8, cone 8 | power 24, area 8 | skip 16, representative 16.
// A quantised sphere still holds all that the exact one held, a quantised cone too; powers round to 2 %.
// Differs from [Ritschel2008]: the child pointer is the index + 1, and its 16 bits name the representative leaf.
#include "lib/sender_tree.glsl"

uvec4 sender_node_texel(uint i);
uvec4 sender_light_texel(uint i);
// Bridge: whether nodes are compact (a constant of the kernel), and what compact ones are quantised in.
bool sender_is_compact();
SenderFrame sender_frame();

// Three channels of 6 bits and a common exponent of 6, in quarters of the largest power's halvings.
uint pack_power(vec3 power, float largest)
{
    float brightest = max(power.r, max(power.g, power.b));
    if (brightest <= 0.0 || largest <= 0.0) return 0;
    uint exponent = uint(clamp(ceil(63.0 + 2.0 * log2(brightest / largest)), 1.0, 63.0));
    float scale = largest * exp2((float(exponent) - 63.0) * 0.5);
    uvec3 m = uvec3(clamp(power / scale * 63.0 + 0.5, 0.0, 63.0));
    return m.r | m.g << 6 | m.b << 12 | exponent << 18;
}

vec3 unpack_power(uint word, float largest)
{
    float scale = largest * exp2((float(word >> 18 & 63u) - 63.0) * 0.5) / 63.0;
    return scale * vec3(word & 63u, word >> 6 & 63u, word >> 12 & 63u);
}

// Of a node's power what it emits itself, W.
vec3 sender_emitted_power(uint i) { return uintBitsToFloat(sender_light_texel(SENDER_LIGHT_TEXELS * i + 1).xyz); }

// A leaf's own index in tree order, or that of an inner node's representative.
uint sender_leaf(uint i)
{
    return sender_is_compact() ? sender_node_texel(i).w >> 16 : sender_light_texel(SENDER_LIGHT_TEXELS * i + 1).w;
}

// Unit, of two signed coordinates on the octahedron that is folded into a square.                            [Meyer2010]
vec3 unpack_axis(uint word)
{
    vec2 v = unpackSnorm2x16(word);
    vec3 n = vec3(v, 1.0 - abs(v.x) - abs(v.y));
    float below = max(-n.z, 0.0);
    n.xy += mix(vec2(below), vec2(-below), greaterThanEqual(n.xy, vec2(0.0)));
    return n / sqrt(dot(n, n));
}

SenderNode unpack_node(uvec4 texel, SenderFrame frame)
{
    SenderNode node;
    node.centre = frame.low + vec3(texel.x & 0xffu, texel.x >> 8 & 0xffu, texel.x >> 16 & 0xffu) / 255.0 * frame.extent;
    node.radius = frame.largest_radius * exp2((float(texel.x >> 24) - 255.0) / 12.0);
    vec3 axis = vec3(texel.y & 0xffu, texel.y >> 8 & 0xffu, texel.y >> 16 & 0xffu) / 127.0 - 1.0;
    node.axis = axis / sqrt(max(dot(axis, axis), 1e-12));
    node.cos_cone = float(texel.y >> 24) / 127.0 - 1.0;
    node.skip = texel.w & 0xffffu;
    vec3 power = unpack_power(texel.z, frame.largest_power);
    node.power = max(power.r, max(power.g, power.b));
    return node;
}

SenderNode sender_node(uint i)
{
    if (sender_is_compact()) return unpack_node(sender_node_texel(i), sender_frame());
    uvec4 sphere = sender_node_texel(SENDER_NODE_TEXELS * i), rest = sender_node_texel(SENDER_NODE_TEXELS * i + 1);
    return SenderNode(uintBitsToFloat(sphere.xyz), uintBitsToFloat(sphere.w), unpack_axis(rest.x), uintBitsToFloat(rest.y),
                      rest.w, uintBitsToFloat(rest.z));
}
#endif
