#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_shader_atomic_int64 : require
#include "lib/prelude.glsl"
#include "lib/bins.glsl"

// One workgroup per group of receiving nodes of a window, a thread for each sender of one kind that the group holds, one
// after the other: proposes it to the bins of all nodes of the group, which keep the nearest.      [Dong2007 4.2.2]
// reads receiver_groups, group_walks, held_senders, sender_texels, receiver_texels [of node_count], corner_texels
// updates keys[rows * 6 n n] (distance bits above, back and node below), link_counts   shared none
// A thread keeps its sender, which is much, and loads receivers, which are little: loads are what costs most.
// Differs from [Dong2007]: a sender fills all the bins whose centres see it, at its distance in each, and blocks where it
// turns its back.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Groups { ReceiverGroup receiver_groups[]; };
layout(set = 0, binding = 1) uniform usamplerBuffer sender_texels;
layout(set = 0, binding = 2) uniform usamplerBuffer receiver_texels;
layout(set = 0, binding = 3) uniform usamplerBuffer corner_texels;
layout(set = 0, binding = 4, scalar) readonly buffer Walks { GroupWalk group_walks[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Held { uint held_senders[]; };
layout(set = 0, binding = 6, scalar) buffer Keys { uint64_t keys[]; };
layout(set = 0, binding = 7, scalar) buffer Counts { LinkCounts link_counts[]; };
layout(push_constant, scalar) uniform Params {
    uint first_group;
    uint group_count;
    uint n;                 // bins a side of a face
    uint capacity;          // senders of each kind that a group may hold
} params;
// Of senders: OF_LEAVES to OF_OUTLINES.
layout(constant_id = 0) const uint KIND = 0;
// 1: one bin a sender, as in the paper.
layout(constant_id = 1) const uint IS_SINGLE = 0;
// 1: leaves' bins are not along the world's axes.
layout(constant_id = 2) const uint IS_TURNED = 0;

#include "methods/implicit_visibility/propose.glsl"

void main()
{
    uint slot = gl_WorkGroupID.x + gl_WorkGroupID.y * gl_NumWorkGroups.x;
    if (slot >= params.group_count) return;
    ReceiverGroup group = receiver_groups[params.first_group + slot];
    uint first = (KINDS * slot + KIND) * params.capacity, count = min(group_walks[slot].held[KIND], params.capacity);
    uint k = gl_LocalInvocationID.x, proposed = 0;
    if (k >= count) return;
    do {
        hold_sender(held_senders[first + k]);
        // Of leaves with many triangles around them, some after the other.
        uint from = 0;
        do {
            if (are_leaves()) hold_corners(from);
            uint receiver = group.first, row = group.row * 6 * params.n * params.n;
            do {
                int at = int(RECEIVER_TEXELS * receiver);
                vec4 origin = uintBitsToFloat(texelFetch(receiver_texels, at));
                vec4 normal = uintBitsToFloat(texelFetch(receiver_texels, at + 1));
                vec4 frame = vec4(0.0, 0.0, 0.0, 1.0);
                if (IS_TURNED != 0) frame = uintBitsToFloat(texelFetch(receiver_texels, at + 2));
                Horizon horizon = Horizon(normal.xyz, normal.w, origin.w);
                bool is_itself = KIND == OF_FLAT_LEAVES && receiver == sender.node;
                bool is_dropped = is_itself || is_below_horizon(horizon, sender.extents, sender.centre - origin.xyz);
                proposed += is_dropped || from != 0 ? 0 : 1;
                link(Receiver(origin.xyz, normal.xyz, frame), row, is_dropped);
                row += 6 * params.n * params.n;
            } while (++receiver < group.first + group.count);
            from += HELD_CORNERS;
        } while (are_leaves() && from < sender.corner_count);
        k += 64;
    } while (k < count);
    atomicAdd(link_counts[0].proposed, proposed);
}
