#ifndef LIB_SENDER_TREE
#define LIB_SENDER_TREE
// The sender tree: a binary tree over everything that sends light, as an array in depth-first order. The left child of
// inner node i is i + 1; `skip` is the node after its subtree, so a walk needs no stack.            [Ritschel2008 4.2]
// Leaves are flat: triangles or parallelograms, seen from the side that their normal points to.
//
// Bridge of what reads nodes: the kernel binds tables of texels, since one fetch brings four words.
//     uvec4 sender_node_texel(uint i)       SENDER_NODE_TEXELS each (compact: one, see lib/sender_pack.glsl)
//     uvec4 sender_light_texel(uint i)      SENDER_LIGHT_TEXELS each
//     uvec4 sender_branch_texel(uint i)     one each
#include "lib/hemisphere.glsl"

struct SenderLeaf {
    vec3 centre;        // centroid, metres
    vec3 edge_u;        // a triangle's edges from its first corner, or a parallelogram's sides
    vec3 edge_v;
    uint is_triangle;
};

// W/m2 per leaf, in tree order.
struct LeafLight {
    vec3 emitted;
    vec3 reflected;
};

// What the walk knows of a node.
struct SenderNode {
    vec3 centre;        // of its bounding sphere, metres
    float radius;
    vec3 axis;          // unit: all normals lie within a cone about it
    float cos_cone;     // of the cone's half angle; -1 where they point everywhere
    uint skip;
    float power;        // that would leave it in its brightest channel, W, if it sent evenly what it sends along its brightest
                        // direction; no intensity is above power / pi times the cosine to the normal
};

// What compact nodes are quantised in.
struct SenderFrame {
    vec3 low;               // of all centres, metres
    float largest_radius;   // metres
    vec3 extent;
    float largest_power;    // of the brightest channel of any node, W
    uint gloss_first;       // texel of the leaves at which tables of shiny ones start
    uint gloss_side;        // of their bins
};

const uint NO_SENDER = 0xffffffffu;

// Texels of a node: centre | radius; axis (octahedral, 16 bits a coordinate), cos_cone, power of the brightest channel,
// skip. Of its light: power, and what
// is added to its brightest channel where lobes send more along their brightest direction; the part of it that is emitted,
// and the leaf that represents the node. Of its branch: the right
// child, and the left one's share of the power; of a leaf: NO_SENDER, and its index.
const uint SENDER_NODE_TEXELS = 2;
const uint SENDER_LIGHT_TEXELS = 2;

float leaf_area(SenderLeaf leaf)
{
    vec3 across = cross(leaf.edge_u, leaf.edge_v);
    return sqrt(dot(across, across)) * (leaf.is_triangle != 0 ? 0.5 : 1.0);
}

// Unit; zero for a leaf without area.
vec3 leaf_normal(SenderLeaf leaf)
{
    vec3 across = cross(leaf.edge_u, leaf.edge_v);
    float length_squared = dot(across, across);
    return length_squared > 0.0 ? across / sqrt(length_squared) : vec3(0.0);
}

// Where the point u of the unit square lies on the leaf, areas in proportion.
vec3 leaf_point(SenderLeaf leaf, vec2 u)
{
    if (leaf.is_triangle != 0) {
        if (u.x + u.y > 1.0) u = 1.0 - u;
        return leaf.centre + (u.x - 1.0 / 3.0) * leaf.edge_u + (u.y - 1.0 / 3.0) * leaf.edge_v;
    }
    return leaf.centre + (u.x - 0.5) * leaf.edge_u + (u.y - 0.5) * leaf.edge_v;
}

// Where a point of the leaf's plane lies, in its sides from the centre.
vec2 sides_on_leaf(SenderLeaf leaf, vec3 point)
{
    vec3 across = cross(leaf.edge_u, leaf.edge_v), offset = point - leaf.centre;
    float squared = dot(across, across);
    if (squared <= 0.0) return vec2(0.0);
    return vec2(dot(cross(offset, leaf.edge_v), across), dot(cross(leaf.edge_u, offset), across)) / squared;
}

// Whether it lies on the leaf.
bool is_on_leaf(SenderLeaf leaf, vec3 point)
{
    vec2 at = sides_on_leaf(leaf, point);
    if (leaf.is_triangle != 0) return min(at.x, at.y) >= -1.0 / 3.0 && at.x + at.y <= 1.0 / 3.0;
    return max(abs(at.x), abs(at.y)) <= 0.5;
}

// A direction in the leaf's own axes: along its first side, across that, along its normal.
vec3 on_leaf_axes(SenderLeaf leaf, vec3 normal, vec3 d)
{
    vec3 along = leaf.edge_u / sqrt(dot(leaf.edge_u, leaf.edge_u));
    return vec3(dot(d, along), dot(d, cross(normal, along)), dot(d, normal));
}

// Corners counter-clockwise seen from the front; returns how many.
uint leaf_corners(SenderLeaf leaf, out vec3 corners[4])
{
    if (leaf.is_triangle != 0) {
        corners[0] = leaf.centre - (leaf.edge_u + leaf.edge_v) / 3.0;
        corners[1] = corners[0] + leaf.edge_u;
        corners[2] = corners[0] + leaf.edge_v;
        corners[3] = corners[2];
        return 3;
    }
    corners[0] = leaf.centre - 0.5 * (leaf.edge_u + leaf.edge_v);
    corners[1] = corners[0] + leaf.edge_u;
    corners[2] = corners[1] + leaf.edge_v;
    corners[3] = corners[0] + leaf.edge_v;
    return 4;
}
#endif
