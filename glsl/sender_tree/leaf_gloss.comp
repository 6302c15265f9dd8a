#version 460
#include "lib/prelude.glsl"
#include "lib/sender_gloss.glsl"

// One thread per shiny leaf: its table from the owner's into the tree's, and what it adds to the power of the leaf's node.
// reads glossy_leaves[glossy_count] (slot, row), leaf_nodes, sent[row * side * side] (radiance, shared exponents), tree_frame
// updates sender_leaves (the tables), sender_light and node_texels of the leaves' nodes   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer GlossyLeaves { uvec2 glossy_leaves[]; };
layout(set = 0, binding = 1, scalar) readonly buffer LeafNodes { uint leaf_nodes[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Sent { uint sent[]; };
layout(set = 0, binding = 3, scalar) readonly buffer TreeFrames { SenderFrame tree_frame[]; };
layout(set = 0, binding = 4, scalar) buffer SenderLeaves { uvec4 sender_leaves[]; };
layout(set = 0, binding = 5, scalar) buffer SenderLight { uvec4 sender_light[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer NodeTexels { uvec4 node_texels[]; };
layout(push_constant, scalar) uniform Params { uint glossy_count; uint is_dark; } params;

uvec4 sender_leaf_texel(uint i) { return sender_leaves[i]; }

void main()
{
    uint i = linear_index();
    if (i >= params.glossy_count) return;

    uint leaf = glossy_leaves[i].x, row = glossy_leaves[i].y, node = leaf_nodes[leaf];
    SenderFrame frame = tree_frame[0];
    uint side = frame.gloss_side, bin_count = side * side, first = gloss_first(frame, row);
    vec3 radiosity = vec3(0.0);
    float brightest = 0.0;
    for (uint k = 0; k < (bin_count + 3) / 4; ++k) {
        uvec4 words = uvec4(0);
        for (uint n = 0; n < 4; ++n) {
            uint bin = 4 * k + n;
            if (params.is_dark != 0 || bin >= bin_count) continue;
            uint word = sent[(row - 1) * bin_count + bin];
            words[n] = word;
            vec3 radiance = decode_32(word);
            radiosity += bin_cosine(bin, side) * bin_solid_angle(side) * radiance;
            brightest = max(brightest, max(radiance.r, max(radiance.g, radiance.b)));
        }
        sender_leaves[first + 1 + k] = words;
    }
    sender_leaves[first] = uvec4(floatBitsToUint(radiosity), 0u);
    if (params.is_dark != 0) return;

    float area = leaf_area(sender_shape(leaf));
    vec3 power = uintBitsToFloat(sender_light[SENDER_LIGHT_TEXELS * node].xyz);
    float largest = max(power.r, max(power.g, power.b)) + PI * brightest * area;
    power += area * radiosity;
    // In the mean over directions the lobe sends less than along its brightest one.
    float beyond = max(largest - max(power.r, max(power.g, power.b)), 0.0);
    sender_light[SENDER_LIGHT_TEXELS * node] = uvec4(floatBitsToUint(power), floatBitsToUint(beyond));
    node_texels[SENDER_NODE_TEXELS * node + 1].z = floatBitsToUint(max(power.r, max(power.g, power.b)) + beyond);
}
