#version 460
#include "lib/prelude.glsl"
#include "lib/face_element.glsl"

// One thread per element: 1 for a leaf; the sums of these number the leaves.                   [Gobbetti2003 4]
// reads elements   writes leaf_indices   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Elements { FaceElement elements[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer LeafIndices { uint leaf_indices[]; };
layout(push_constant, scalar) uniform Params { uint element_count; } params;

void main()
{
    uint e = linear_index();
    if (e >= params.element_count) return;
    leaf_indices[e] = elements[e].children == NO_FACE_ELEMENT ? 1 : 0;
}
