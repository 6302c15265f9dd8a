#ifndef LIB_ELEMENT
#define LIB_ELEMENT
// Finite elements: one per vertex, and one more per vertex of a double-sided surface for its back.
const uint BACK_SIDE = 0x80000000u;     // of an entry of element_vertices
const uint NO_ELEMENT = 0xffffffffu;    // of an entry of back_elements: the surface is one-sided

// A place in the open that an element looks from, whose vertex stands inside of something; see stages::open_places.
struct OpenPlace {
    uint triangle;          // around its vertex; NO_ELEMENT: it looks from its vertex
    vec2 barycentrics;      // of corners 1 and 2
};

uint vertex_of(uint entry) { return entry & ~BACK_SIDE; }
float side_of(uint entry) { return (entry & BACK_SIDE) != 0 ? -1.0 : 1.0; }
#endif
