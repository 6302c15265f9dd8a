#ifndef LIB_QUADTREE
#define LIB_QUADTREE
// Quadtrees over elements, stored by levels without pointers; see stages::quadtree::topology.

// One tree's nodes on one level.
struct QuadtreeSegment {
    uint first;         // node
    uint count;
    uint parent_first;  // first node of the tree's next level, NO_PARENT for the root
    uint child_first;   // first node of the tree's level below
    uint child_count;   // of that level; 0 for leaves
    uint level;         // 0 for leaves
    uint tree;
};
const uint NO_PARENT = 0xffffffffu;

// The surface of a node as the sender and the receiver of links: an ellipse in the plane across its mean normal, in
// which dot(g1, x)^2 + dot(g2, x)^2 <= 1 for offsets x from the centre, and bounds on how far the node departs from it.
struct Surfel {
    vec3 centre;        // area-weighted mean place, m
    vec3 normal;        // unit; zero without area
    vec3 g1;            // 1/m; both zero without area
    vec3 g2;
    float extent;       // half the length of the longer axis as the refinement sees it, m
    float radius;       // of a sphere around the centre that holds all of the node, m
    float thickness;    // the node lies within this distance of its plane, m
    float cos_cone;     // all normals of the node are within this cone about the normal; -1: any
    float area;         // m2
};

// What a level is pulled up from: sums over the surface.
struct SurfelMoments {
    vec3 diagonal;      // covariance of the surface's points: xx, yy, zz, m2
    vec3 mixed;         // xy, yz, zx
    vec3 across;        // sum of normals times area, m2
};

// The surface of a leaf: the part of the triangles around its vertex that is nearer to it, by barycentric coordinates,
// than to their other corners.
struct LeafCell {
    vec3 vertex;        // m
    uint first_corner;
    uint corner_count;
    uint sides;         // CELL_OF_BACK, CELL_HAS_OTHER_SIDE
};
const uint CELL_OF_BACK = 1;            // it looks against the triangles' normals
const uint CELL_HAS_OTHER_SIDE = 2;     // another leaf looks the other way

// A triangle around a vertex, in texels: products of the offset from the vertex with `along_p` and `along_q` are the
// barycentric coordinates of the other corners, in order; without area both are beyond all bounds.
//   0, 1: along_p; along_q (1/m)
//   2: the same per half axis of the leaf's ellipse: p's two, q's two
// The first texels of all are of no triangle: where a loop over a leaf's ends before others'.
const uint CORNER_TEXELS = 3;

// A step of the walk over all nodes from the roots down: where it goes on where a node's children are not looked at.
struct WalkStep {
    uint node;
    uint skip;
};

// The same with what the walk looks at, in texels:
//   0: centre (m) | radius (m)
//   1: normal | extent (m)
//   2: node | skip | thickness (m) | cos_cone
const uint WALK_TEXELS = 3;

// Children of a node: the first, and how many.
uvec2 quadtree_children(QuadtreeSegment s, uint node)
{
    uint first = 4 * (node - s.first);
    return uvec2(s.child_first + first, min(4u, s.child_count - first));
}

uint quadtree_parent(QuadtreeSegment s, uint node) { return s.parent_first + (node - s.first) / 4; }
#endif
