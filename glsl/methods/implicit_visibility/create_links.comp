#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/footprint.glsl"
#include "lib/surfel.glsl"
#include "methods/implicit_visibility/horizon.glsl"

// One workgroup per group of receiving nodes of a window, a thread for each: proposes the senders of one kind that the
// group holds to its own bins, which keep the nearest.                                             [Dong2007 4.2.2]
// reads receiver_groups, group_walks, held_senders, surfels, moments [node_count], receivers, leaf_cells [leaf_count],
// cell_corners   updates keys[rows * 6 n n] (distance bits above, back and node below; each row by its own thread),
// link_counts   shared none
// Differs from [Dong2007]: a sender fills all the bins whose centres see it, at its distance in each, and blocks where it
// turns its back.
layout(local_size_x = 16) in;
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
// Of senders: OF_LEAVES, OF_PLANES, OF_OUTLINES.
layout(constant_id = 0) const uint KIND = 0;
// 1: one bin a sender, as in the paper.
layout(constant_id = 1) const uint IS_SINGLE = 0;
// 1: leaves' bins are not along the world's axes.
layout(constant_id = 2) const uint IS_TURNED = 0;

const float FLAT = 1e-3;    // a cell as thin as this, against its radius, is a plane

#include "methods/implicit_visibility/propose.glsl"

void main()
{
    // What a workgroup has in common is told by its own index: then its loads are common too.
    uint slot = gl_WorkGroupID.x + gl_WorkGroupID.y * gl_NumWorkGroups.x, lane = gl_LocalInvocationID.x;
    if (slot >= params.group_count) return;
    ReceiverGroup group = receiver_groups[params.first_group + slot];
    uint first = (3 * slot + KIND) * params.capacity, count = group_walks[slot].held[KIND];
    if (lane >= group.count || count == 0) return;

    uint receiver = group.first + lane;
    row_first_key = (group.row + lane) * 6 * params.n * params.n;
    Surfel a = surfels[receiver];
    Extents own = Extents(a.normal, a.cos_cone, a.radius, a.thickness);
    at = Receiver(a.centre, a.normal, vec4(0.0, 0.0, 0.0, 1.0));
    if (group.first < params.leaf_count) {
        // It receives at one point with one normal.
        at = receivers[receiver];
        own = Extents(at.normal, 1.0, 0.0, 0.0);
    }

    uint proposed = 0;
    for (uint k = first; k < first + count; ++k) {
        sender = held_senders[k];
        b = surfels[sender];
        offset = b.centre - at.origin;
        bool is_itself = receiver == sender && b.thickness <= FLAT * b.radius;
        if (!is_itself && !is_below_horizon(own, Extents(b.normal, 0.0, b.radius, b.thickness), offset)) {
            ++proposed;
            link();
        }
    }
    atomicAdd(link_counts[0].proposed, proposed);
}
