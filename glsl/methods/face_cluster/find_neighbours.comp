#version 460
#include "lib/prelude.glsl"
#include "lib/face_element.glsl"

// One thread per element: of a leaf, all leaves of its side whose light reaches into its box and that look the same way;
// depth first through the elements of its instance. Run twice: for their numbers, then for themselves.
//                                                                                              [Gobbetti2003 2]
// reads elements, leaf_indices   writes neighbour_offsets (numbers) or reads them and writes neighbours   shared none
// Differs from [Gobbetti2003]: which names a post-pass against steps between leaves, and does without.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Elements { FaceElement elements[]; };
layout(set = 0, binding = 1, scalar) readonly buffer LeafIndices { uint leaf_indices[]; };
layout(set = 0, binding = 2, scalar) buffer NeighbourOffsets { uint neighbour_offsets[]; };     // per leaf, and one more
layout(set = 0, binding = 3, scalar) writeonly buffer Neighbours { uint neighbours[]; };
layout(push_constant, scalar) uniform Params {
    uint element_count;
    float reach;            // over a leaf's border, in its shorter half sides
    uint writes;            // 0: numbers alone
} params;

// Cosine of the largest angle between leaves that are one surface.
const float SAME_SURFACE = 0.8;
// Leaves of a row, at most: more would lie upon each other.
const uint MOST_NEIGHBOURS = 64u;

// Whether the box of `a` comes nearer than `margin` to that of `b`, by the axes of both.
bool boxes_meet(FaceElement a, FaceElement b, float margin)
{
    vec3 d = b.center - a.center;
    vec3 axes[6] = vec3[6](a.axis_x, a.axis_y, a.axis_z, b.axis_x, b.axis_y, b.axis_z);
    for (uint k = 0; k < 6; ++k)
        if (abs(dot(d, axes[k])) > reach(a, axes[k]) + reach(b, axes[k]) + margin) return false;
    return true;
}

void main()
{
    uint own = linear_index();
    if (own >= params.element_count || elements[own].children != NO_FACE_ELEMENT) return;
    FaceElement leaf = elements[own];
    uint row = params.writes != 0 ? neighbour_offsets[leaf_indices[own]] : 0, count = 0;
    uint root = leaf.instance, n = root;
    while (true) {
        FaceElement e = elements[n];
        bool is_leaf = e.children == NO_FACE_ELEMENT;
        // What lies below an inner element may reach out of its box by as much as its longer side lets it.
        float margin = params.reach * (is_leaf ? min(e.half_extent.x, e.half_extent.y) : max(e.half_extent.x, e.half_extent.y));
        bool enters = boxes_meet(leaf, e, margin);
        if (enters && !is_leaf) {
            n = e.children;
            continue;
        }
        if (enters && n != own && dot(e.axis_z, leaf.axis_z) > SAME_SURFACE && count < MOST_NEIGHBOURS) {
            if (params.writes != 0) neighbours[row + count] = leaf_indices[n];
            ++count;
        }
        while (n != root && n != elements[elements[n].parent].children) n = elements[n].parent;
        if (n == root) break;
        ++n;
    }
    if (params.writes == 0) neighbour_offsets[leaf_indices[own]] = count;
}
