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

// Nodes of a cut that are gathered from together. Threads in lockstep walk until each has so many or is through, and then
// gather: node by node all would wait for the slowest of them at each.
const uint SENDER_BATCH = 32;
uint sender_batch[SENDER_BATCH];

// The next nodes of the cut at or after `node`, `most` of them, or fewer behind the last; moves `node` behind them. Ends for
// any table: every step goes to a larger index.
uint next_senders(uint most, inout uint node, uint node_count, inout uint visited)
{
    uint count = 0;
    while (count < most && node < node_count) {
        SenderNode sender = sender_node(node);
        bool is_leaf = sender.skip == node + 1;
        uint decision = sender_decision(sender, is_leaf);
        bool refine = decision == SENDER_REFINE && !is_leaf;
        if (decision != SENDER_IGNORE && !refine) sender_batch[count++] = node;
        node = refine ? node + 1 : max(sender.skip, node + 1);
        ++visited;
    }
    return count;
}

// How many follow on `most`: few at first, while a cut knows little of what the receiver will show.
uint more_senders(uint most) { return min(2 * most, SENDER_BATCH); }

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
