#version 460
#include "lib/prelude.glsl"
#include "lib/sender_leaf.glsl"

// One thread per leaf: its light from the owner's order into the tree's, and the power of its node.  [Ritschel2008 4.2]
// reads leaf_order, leaf_nodes [leaf_count], emitted, reflected (W/m2, in the owner's order)
// writes sender_light of the leaves' nodes   updates the light in sender_leaves, the power in node_texels   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer LeafOrder { uint leaf_order[]; };      // the owner's index
layout(set = 0, binding = 1, scalar) readonly buffer LeafNodes { uint leaf_nodes[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Emitted { vec3 emitted[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Reflected { vec3 reflected[]; };
layout(set = 0, binding = 4, scalar) buffer SenderLeaves { uvec4 sender_leaves[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer SenderLight { uvec4 sender_light[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer NodeTexels { uvec4 node_texels[]; };
layout(push_constant, scalar) uniform Params { uint leaf_count; } params;

uvec4 sender_leaf_texel(uint i) { return sender_leaves[i]; }

// Light is finite and not negative, whatever a method left there.
vec3 usable(vec3 light) { return mix(vec3(0.0), light, bvec3(light.x > 0.0 && light.x < 1e30, light.y > 0.0 && light.y < 1e30, light.z > 0.0 && light.z < 1e30)); }

void main()
{
    uint leaf = linear_index();
    if (leaf >= params.leaf_count) return;

    uint owner = leaf_order[leaf], node = leaf_nodes[leaf];
    LeafLight light = LeafLight(usable(emitted[owner]), usable(reflected[owner]));
    sender_leaves[SENDER_LEAF_TEXELS * leaf + 2].zw = floatBitsToUint(light.emitted.xy);
    sender_leaves[SENDER_LEAF_TEXELS * leaf + 3] = floatBitsToUint(vec4(light.emitted.z, light.reflected));
    float area = leaf_area(sender_shape(leaf));
    vec3 emitted_power = area * light.emitted;
    vec3 power = emitted_power + area * light.reflected;
    sender_light[SENDER_LIGHT_TEXELS * node] = uvec4(floatBitsToUint(power), 0u);
    sender_light[SENDER_LIGHT_TEXELS * node + 1] = uvec4(floatBitsToUint(emitted_power), leaf);
    node_texels[SENDER_NODE_TEXELS * node + 1].z = floatBitsToUint(max(power.r, max(power.g, power.b)));
}
