#version 460
#include "lib/prelude.glsl"
#include "lib/face_element.glsl"

// One thread per triangle: the number of the leaf that holds it, of its front and of its back.       [Gobbetti2003 3.5]
// reads elements, triangle_places, triangle_roots (front and back), leaf_indices   writes triangle_leaves (front and back)
// shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Elements { FaceElement elements[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Places { uint triangle_places[]; };
layout(set = 0, binding = 2, scalar) readonly buffer TriangleRoots { uvec2 triangle_roots[]; };   // NO_FACE_ELEMENT: no such side
layout(set = 0, binding = 3, scalar) readonly buffer LeafIndices { uint leaf_indices[]; };            // per element
layout(set = 0, binding = 4, scalar) writeonly buffer TriangleLeaves { uvec2 triangle_leaves[]; };
layout(push_constant, scalar) uniform Params { uint triangle_count; } params;

uint leaf_of(uint root, uint place)
{
    uint e = root;
    while (e != NO_FACE_ELEMENT && elements[e].children != NO_FACE_ELEMENT) {
        uint left = elements[e].children;
        e = place - elements[left].first_place < elements[left].place_count ? left : left + 1;
    }
    return e == NO_FACE_ELEMENT ? e : leaf_indices[e];
}

void main()
{
    uint t = linear_index();
    if (t >= params.triangle_count) return;
    uint place = triangle_places[t];
    triangle_leaves[t] = uvec2(leaf_of(triangle_roots[t].x, place), leaf_of(triangle_roots[t].y, place));
}
