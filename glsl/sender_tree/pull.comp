#version 460
#include "lib/prelude.glsl"
#include "lib/sender_tree.glsl"

// One thread per inner node of a level: its power is the sum of its children's, its representative that of the child with
// more power, or more area.                                                                      [Ritschel2008 4.1]
// reads level_nodes[inner_count], node_areas (m2); the levels below are done
// updates sender_light, the power in node_texels, the share in branches   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer LevelNodes { uint level_nodes[]; };    // by depth, deepest last
layout(set = 0, binding = 1, scalar) readonly buffer NodeAreas { float node_areas[]; };
layout(set = 0, binding = 2, scalar) buffer SenderLight { uvec4 sender_light[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer NodeTexels { uvec4 node_texels[]; };
layout(set = 0, binding = 4, scalar) buffer Branches { uvec4 branches[]; };
layout(push_constant, scalar) uniform Params { uint first; uint count; uint by_area; } params;

float sum_of(vec3 power) { return power.r + power.g + power.b; }

void main()
{
    uint k = linear_index();
    if (k >= params.count) return;

    uint node = level_nodes[params.first + k];
    uint left = node + 1, right = branches[node].x;
    vec3 power_left = uintBitsToFloat(sender_light[SENDER_LIGHT_TEXELS * left].xyz);
    vec3 power_right = uintBitsToFloat(sender_light[SENDER_LIGHT_TEXELS * right].xyz);
    uvec4 rest_left = sender_light[SENDER_LIGHT_TEXELS * left + 1], rest_right = sender_light[SENDER_LIGHT_TEXELS * right + 1];
    float weight_left = sum_of(power_left), weight_right = sum_of(power_right), weight = weight_left + weight_right;
    branches[node].y = floatBitsToUint(weight > 0.0 ? weight_left / weight : 0.5);
    if (params.by_area != 0) {
        weight_left = node_areas[left];
        weight_right = node_areas[right];
    }
    float beyond = uintBitsToFloat(sender_light[SENDER_LIGHT_TEXELS * left].w) + uintBitsToFloat(sender_light[SENDER_LIGHT_TEXELS * right].w);
    vec3 power = power_left + power_right, emitted = uintBitsToFloat(rest_left.xyz) + uintBitsToFloat(rest_right.xyz);
    sender_light[SENDER_LIGHT_TEXELS * node] = uvec4(floatBitsToUint(power), floatBitsToUint(beyond));
    sender_light[SENDER_LIGHT_TEXELS * node + 1] = uvec4(floatBitsToUint(emitted), weight_left >= weight_right ? rest_left.w : rest_right.w);
    node_texels[SENDER_NODE_TEXELS * node + 1].z = floatBitsToUint(max(power.r, max(power.g, power.b)) + beyond);
}
