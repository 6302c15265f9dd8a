#ifndef LIB_BVH_PACK
#define LIB_BVH_PACK
// How nodes and triangles of the hierarchy are laid out in texels; see lib/bvh.glsl for what reads them.

// A node is three texels.
//   0: origin xyz (metres, world) | exponents of its grid, 8 bits an axis, and the kinds of its children, 2 bits each
//   1: bounds along x (low, high) and y (low, high), a byte a child, in cells of the grid
//   2: bounds along z (low, high) | node of the first inner child | slot of the first triangle of the leaves
// Inner children come first and are neighbours, as are the triangles of all leaves of a node.    [Ylitie2017]
const uint NODE_TEXELS = 3;
const uint KIND_INNER = 3; // 1 and 2: a leaf of as many triangles; 0: no child

uint child_kind(uint word, uint k) { return word >> 24 + 2 * k & 3; }

// Size of a grid cell along each axis: powers of two, so that decoding is exact.
vec3 grid_cell(uint word) { return uintBitsToFloat(uvec3(word, word >> 8, word >> 16) << 23 & 0x7f800000u); }

// A triangle is three texels: nine coordinates of corners as they are in the vertex buffer, so that neighbours share
// theirs bit by bit; then its index in the scene.
const uint TRIANGLE_TEXELS = 3;

// A triangle's place in leaf order.
struct BvhSlot {
    uvec3 vertices;
    uint triangle;
};

// metres, world.
struct BvhBounds {
    vec3 low;
    vec3 high;
};

// How far boxes are widened per metre of coordinate, so that rounding in the slab test, or of a corner in the ray's
// frame, never loses a triangle: some twenty units in the last place. Boxes carry the share of their own coordinates
// (see bvh/refit_nodes), rays that of their origin.
const float BVH_SLACK = 2e-6;
#endif
