#ifndef LIB_HIERARCHY
#define LIB_HIERARCHY
// A hierarchy over leaf elements in depth-first order: the children of a node stand behind it, each after the other's
// subtree. Filled by stages/hierarchy.
struct HierarchyNode {
    vec3 center;        // of area, metres
    float radius;       // of a sphere around center that holds everything below, metres
    float area;         // of all leaves below, m2
    uint skip;          // first node after the subtree
    uint parent;        // NONE for the root
    uint leaf;          // index of the leaf, NONE for an inner node
    uint shape;         // a leaf whose normal and flags are those of all below: its own, one of a flat surface's, else NONE
    uint surface;       // the flat surface that all below lies in, else NONE
    float margin;       // how far anything below may move from its place at rest, metres
    vec3 half_u;        // of a rectangle in place of what lies below, if that is flat (shape): half of its sides, metres
    vec3 half_v;
};

// One per vertex, or per patch of a flat part: both sides of the cells of its members.
struct HierarchyLeaf {
    vec3 normal;        // unit, of the cells' vector area
    float area;         // length of the vector area, m2
    uint node;
    uint element;       // of the front of its middle vertex
    uint back_element;  // of its back; NONE where one-sided
    uint flags;
    uint first_member;  // its vertices, in the list of all leaves'
    uint member_count;
    uvec2 along;        // vertices that its rectangle lies along; NONE: its middle vertex's shortest edge
};

// A leaf that a vertex takes light from.
struct LeafShare {
    uint leaf;
    float share;        // all of a vertex sum to 1
};
const uint NONE = 0xffffffffu;
const uint BLOCKS_BEHIND = 1u;      // light that meets the back is blocked
const uint REFLECTS_BEHIND = 2u;    // the back reflects like the front
#endif
