#version 460
#include "lib/prelude.glsl"
#include "lib/cluster_basis.glsl"
#include "lib/face_element.glsl"
#include "lib/leaf_element.glsl"

// One thread per element: of a leaf, its place and light go to the table of leaves, which is all that is kept of a
// solution.                                                                                    [Gobbetti2003 4]
// reads elements, leaf_indices, direct and indirect irradiance (per element and function, W/m2)   writes leaves and
// their irradiance (per leaf and function)   shared none
// Differs from [Gobbetti2003]: a shared exponent; light from emitters apart from what was reflected. Steep light's fit
// falls below zero, which showed as black corners beside lamps: functions beyond the first are limited.
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

// By how much the functions beyond the first count, so that light on the plane of the mean normal is not negative at
// the corners of the box, between them and in the middle, and its mean stays.                               [Zhang2010]
// Elements that bend have no such plane.
float limit_of(mat3 light[MOST_FUNCTIONS], FaceElement element)
{
    if (is_bent(element)) return 1.0;
    vec3 mean = element.axis_z * light[0];
    float limit = 1.0;
    for (uint point = 0; point < 9; ++point) {
        vec2 uv = 0.5 * vec2(point % 3, point / 3);
        vec3 there = mean;
        for (uint k = 1; k < params.functions; ++k) there += basis(k, uv) * (element.axis_z * light[k]);
        for (uint c = 0; c < 3; ++c)
            if (mean[c] > 0.0 && there[c] < 0.0) limit = min(limit, mean[c] / (mean[c] - there[c]));
    }
    return limit;
}

void main()
{
    uint e = linear_index();
    if (e >= params.element_count || elements[e].children != NO_FACE_ELEMENT) return;
    uint leaf = leaf_indices[e];
    leaves[leaf] = LeafElement(elements[e].center, elements[e].axis_x, elements[e].axis_y, elements[e].half_extent);
    mat3 direct[MOST_FUNCTIONS], indirect[MOST_FUNCTIONS];
    for (uint k = 0; k < params.functions; ++k) {
        direct[k] = direct_irradiance[e * params.functions + k];
        indirect[k] = indirect_irradiance[e * params.functions + k];
    }
    float direct_limit = limit_of(direct, elements[e]), indirect_limit = limit_of(indirect, elements[e]);
    for (uint k = 0; k < params.functions; ++k) {
        vec2 limit = k == 0 ? vec2(1.0) : vec2(direct_limit, indirect_limit);
        leaf_direct[leaf * params.functions + k] = packed(limit.x * direct[k], params.inverse_unit);
        leaf_indirect[leaf * params.functions + k] = packed(limit.y * indirect[k], params.inverse_unit);
    }
}
