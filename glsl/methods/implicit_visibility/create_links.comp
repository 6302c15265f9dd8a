#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_shader_atomic_int64 : require
#include "lib/prelude.glsl"
#include "lib/footprint.glsl"
#include "lib/surfel.glsl"
#include "methods/implicit_visibility/horizon.glsl"

// One workgroup per group of receiving nodes of a window, a thread for each sender of one kind that the group holds, one
// after the other: proposes it to the bins of all nodes of the group, which keep the nearest.      [Dong2007 4.2.2]
// reads receiver_groups, group_walks, held_senders, surfels, moments [node_count], receivers, leaf_cells [leaf_count],
// cell_corners   updates keys[rows * 6 n n] (distance bits above, back and node below), link_counts   shared none
// A thread keeps its sender, which is much, and loads receivers, which are little: loads are what costs most.
// Differs from [Dong2007]: a sender fills all the bins whose centres see it, at its distance in each, and blocks where it
// turns its back.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Groups { ReceiverGroup receiver_groups[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Surfels { Surfel surfels[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Moments { SurfelMoments moments[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Receivers { Receiver receivers[]; };
layout(set = 0, binding = 4, scalar) readonly buffer LeafCells { LeafCell leaf_cells[]; };
layout(set = 0, binding = 5, scalar) readonly buffer CellCorners { CellCorner cell_corners[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Walks { GroupWalk group_walks[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Held { uint held_senders[]; };
layout(set = 0, binding = 8, scalar) buffer Keys { uint64_t keys[]; };
layout(set = 0, binding = 9, scalar) buffer Counts { LinkCounts link_counts[]; };
layout(push_constant, scalar) uniform Params {
    uint first_group;
    uint group_count;
    uint n;                 // bins a side of a face
    uint leaf_count;
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
    bool of_leaves = group.first < params.leaf_count;
    uint first = (KINDS * slot + KIND) * params.capacity, count = group_walks[slot].held[KIND];
    uint proposed = 0;
    for (uint k = gl_LocalInvocationID.x; k < count; k += 64) {
        sender = held_senders[first + k];
        b = surfels[sender];
        Extents extents = Extents(b.normal, 0.0, b.radius, b.thickness);
        if (are_leaves()) cell = leaf_cells[sender];
        hold_ellipse(b);
        // Of leaves with many triangles around them, some after the other.
        uint from = 0;
        do {
            if (are_leaves()) hold_corners(from);
            for (uint receiver = group.first; receiver < group.first + group.count; ++receiver) {
                Extents own;
                if (of_leaves) {
                    // It receives at one point with one normal.
                    at = receivers[receiver];
                    own = Extents(at.normal, 1.0, 0.0, 0.0);
                } else {
                    at = Receiver(surfels[receiver].centre, surfels[receiver].normal, vec4(0.0, 0.0, 0.0, 1.0));
                    own = Extents(at.normal, surfels[receiver].cos_cone, surfels[receiver].radius, surfels[receiver].thickness);
                }
                offset = b.centre - at.origin;
                bool is_itself = KIND == OF_FLAT_LEAVES && receiver == sender;
                if (!is_itself && !is_below_horizon(own, extents, offset)) {
                    proposed += from == 0 ? 1 : 0;
                    link((group.row + receiver - group.first) * 6 * params.n * params.n);
                }
            }
            from += HELD_CORNERS;
        } while (are_leaves() && from < cell.corner_count);
    }
    atomicAdd(link_counts[0].proposed, proposed);
}
