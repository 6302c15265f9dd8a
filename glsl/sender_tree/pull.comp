#version 460
#include "lib/prelude.glsl"
#include "lib/sender_tree.glsl"

// One thread per inner node of a level: its power is the sum of its children's, its representative that of the child with
// more power, or more area.                                                                      [Ritschel2008 4.1]
// reads level_nodes[inner_count], node_texels   updates sender_light; the levels below are done   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer LevelNodes { uint level_nodes[]; };    // by depth, deepest last
layout(set = 0, binding = 1, scalar) readonly buffer NodeTexels { uvec4 node_texels[]; };
layout(set = 0, binding = 2, scalar) buffer SenderLight { uvec4 sender_light[]; };
layout(push_constant, scalar) uniform Params { uint first; uint count; uint by_area; } params;

void main()
{
    uint k = linear_index();
    if (k >= params.count) return;

    uint node = level_nodes[params.first + k];
    uint left = node + 1;
    uint right = node_texels[SENDER_NODE_TEXELS * left + 2].y;
    vec4 power_left = uintBitsToFloat(sender_light[SENDER_LIGHT_TEXELS * left]);
    vec4 power_right = uintBitsToFloat(sender_light[SENDER_LIGHT_TEXELS * right]);
    uvec4 rest_left = sender_light[SENDER_LIGHT_TEXELS * left + 1], rest_right = sender_light[SENDER_LIGHT_TEXELS * right + 1];
    float weight_left = power_left.w, weight_right = power_right.w;
    if (params.by_area != 0) {
        weight_left = uintBitsToFloat(node_texels[SENDER_NODE_TEXELS * left + 2].x);
        weight_right = uintBitsToFloat(node_texels[SENDER_NODE_TEXELS * right + 2].x);
    }
    vec3 emitted = uintBitsToFloat(rest_left.xyz) + uintBitsToFloat(rest_right.xyz);
    sender_light[SENDER_LIGHT_TEXELS * node] = floatBitsToUint(power_left + power_right);
    sender_light[SENDER_LIGHT_TEXELS * node + 1] = uvec4(floatBitsToUint(emitted), weight_left >= weight_right ? rest_left.w : rest_right.w);
}
