#version 460
#include "lib/prelude.glsl"
#include "lib/sender_tree.glsl"

// One thread per leaf: its light from the owner's order into the tree's, and the power of its node.  [Ritschel2008 4.2]
// reads leaf_order, leaf_nodes, leaves [leaf_count], emitted, reflected (W/m2, in the owner's order)
// writes leaf_light[leaf_count], sender_light of the leaves' nodes   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer LeafOrder { uint leaf_order[]; };      // the owner's index
layout(set = 0, binding = 1, scalar) readonly buffer LeafNodes { uint leaf_nodes[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Leaves { SenderLeaf leaves[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Emitted { vec3 emitted[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Reflected { vec3 reflected[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer LeafLights { LeafLight leaf_light[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer SenderLight { uvec4 sender_light[]; };
layout(push_constant, scalar) uniform Params { uint leaf_count; } params;

// Light is finite and not negative, whatever a method left there.
vec3 usable(vec3 light) { return mix(vec3(0.0), light, bvec3(light.x > 0.0 && light.x < 1e30, light.y > 0.0 && light.y < 1e30, light.z > 0.0 && light.z < 1e30)); }

void main()
{
    uint leaf = linear_index();
    if (leaf >= params.leaf_count) return;

    uint owner = leaf_order[leaf];
    LeafLight light = LeafLight(usable(emitted[owner]), usable(reflected[owner]));
    leaf_light[leaf] = light;
    float area = leaf_area(leaves[leaf]);
    vec3 emitted_power = area * light.emitted;
    vec3 power = emitted_power + area * light.reflected;
    uint node = SENDER_LIGHT_TEXELS * leaf_nodes[leaf];
    sender_light[node] = floatBitsToUint(vec4(power, power.x + power.y + power.z));
    sender_light[node + 1] = uvec4(floatBitsToUint(emitted_power), leaf);
}
