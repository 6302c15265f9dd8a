#ifndef LIB_SENDER_WALK
#define LIB_SENDER_WALK
// The one walk over the sender tree: refine and gather in one, without a stack.                 [Ritschel2008 Fig. 10]
//
// Bridges, beside the tables of lib/sender_tree.glsl:
//     uint sender_decision(SenderNode node, bool is_leaf)      what to do with the node
//     uvec4 sender_branch_texel(uint i)
#include "lib/sender_pack.glsl"

const uint SENDER_IGNORE = 0u;  // it sends nothing here: go on behind its subtree
const uint SENDER_TAKE = 1u;    // good enough: it belongs to the cut
const uint SENDER_REFINE = 2u;  // look at its children; a leaf is taken

uint sender_decision(SenderNode node, bool is_leaf);
uvec4 sender_branch_texel(uint i);

// The next node of the cut at or after `node`, or NO_SENDER; moves `node` behind it. Ends for any table: every step
// goes to a larger index.
uint next_sender(inout uint node, uint node_count, inout uint visited)
{
    while (node < node_count) {
        SenderNode sender = sender_node(node);
        uint index = node;
        uint decision = sender_decision(sender, sender.skip == index + 1);
        bool refine = decision == SENDER_REFINE && sender.skip != index + 1;
        node = refine ? index + 1 : max(sender.skip, index + 1);
        ++visited;
        if (decision != SENDER_IGNORE && !refine) return index;
    }
    return NO_SENDER;
}

// A leaf below `node`, drawn about in proportion to the power of the leaves, and the probability it is drawn with; `u` in
// 0..1 is used up and left as new.
uint draw_leaf(uint node, inout float u, out float probability)
{
    probability = 1.0;
    uvec4 branch = sender_branch_texel(node);
    while (branch.x != NO_SENDER) {
        float share = uintBitsToFloat(branch.y);
        bool goes_left = u < share;
        float taken = goes_left ? share : 1.0 - share;
        u = min((goes_left ? u : u - share) / taken, 0.99999994);
        probability *= taken;
        node = goes_left ? node + 1 : branch.x;
        branch = sender_branch_texel(node);
    }
    return branch.y;
}
#endif
