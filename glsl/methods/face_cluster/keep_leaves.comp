#version 460
#include "lib/prelude.glsl"
#include "lib/face_element.glsl"

// One thread per element: of a leaf, its place and light go to the table of leaves, which is all that is kept of a
// solution.                                                                                    [Gobbetti2003 4]
// reads elements, leaf_indices, direct and indirect irradiance (per element and function, W/m2)   writes leaves and
// their irradiance (per leaf and function)   shared none
// Differs from [Gobbetti2003]: a shared exponent; light from emitters apart from what was reflected.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Elements { FaceElement elements[]; };
layout(set = 0, binding = 1, scalar) readonly buffer LeafIndices { uint leaf_indices[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Direct { mat3 direct_irradiance[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Indirect { mat3 indirect_irradiance[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer Leaves { LeafElement leaves[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer LeafDirect { SharedVectors leaf_direct[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer LeafIndirect { SharedVectors leaf_indirect[]; };
layout(push_constant, scalar) uniform Params {
    uint element_count;
    uint functions;
    float inverse_unit;     // of what is kept, per W/m2
} params;

void main()
{
    uint e = linear_index();
    if (e >= params.element_count || elements[e].children != NO_FACE_ELEMENT) return;
    uint leaf = leaf_indices[e];
    leaves[leaf] = LeafElement(elements[e].center, elements[e].axis_x, elements[e].axis_y, elements[e].half_extent);
    for (uint k = 0; k < params.functions; ++k) {
        leaf_direct[leaf * params.functions + k] = packed(direct_irradiance[e * params.functions + k], params.inverse_unit);
        leaf_indirect[leaf * params.functions + k] = packed(indirect_irradiance[e * params.functions + k], params.inverse_unit);
    }
}
