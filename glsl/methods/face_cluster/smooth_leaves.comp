#version 460
#include "lib/prelude.glsl"
#include "lib/cluster_basis.glsl"
#include "lib/face_element.glsl"

// One thread per element: a leaf's light is that of its four corners, each the mean of all leaves of its side that meet
// there and look the same way: the post-pass against steps between leaves.                     [Gobbetti2003 2]
// reads elements, leaf_indices, direct and indirect irradiance (per element and function, W/m2)   writes leaf_direct and
// leaf_indirect (per leaf, four functions)   shared none
// Differs from [Gobbetti2003]: which names it and does without.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Elements { FaceElement elements[]; };
layout(set = 0, binding = 1, scalar) readonly buffer LeafIndices { uint leaf_indices[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Direct { mat3 direct_irradiance[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Indirect { mat3 indirect_irradiance[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer LeafDirect { HalfVectors leaf_direct[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer LeafIndirect { HalfVectors leaf_indirect[]; };
layout(constant_id = 0) const uint IRRADIANCE_FUNCTIONS = 3u;
layout(push_constant, scalar) uniform Params {
    uint element_count;
    float inverse_unit;     // of the half floats, per W/m2
} params;

// Leaves meet where they come this near, as a share of the asking leaf's shorter half side.
const float REACH = 0.1;
// Cosine of the largest angle between leaves that are one surface.
const float SAME_SURFACE = 0.8;

bool is_near(FaceElement e, vec3 point, float reach_of_box)
{
    vec3 d = point - e.center;
    vec3 along = abs(vec3(dot(d, e.axis_x), dot(d, e.axis_y), dot(d, e.axis_z)));
    return all(lessThanEqual(along, e.half_extent + reach_of_box));
}

void add_light(uint e, vec3 point, inout mat3 direct, inout mat3 indirect)
{
    vec2 uv = clamp(plane_coordinates(elements[e], point), 0.0, 1.0);
    for (uint k = 0; k < IRRADIANCE_FUNCTIONS; ++k) {
        float b = basis(k, uv);
        direct += b * direct_irradiance[e * IRRADIANCE_FUNCTIONS + k];
        indirect += b * indirect_irradiance[e * IRRADIANCE_FUNCTIONS + k];
    }
}

// Mean light at a corner over the leaf and all that meet it: depth first through the elements of its instance.
void corner_light(uint leaf, vec3 point, out mat3 direct, out mat3 indirect)
{
    direct = indirect = mat3(0.0);
    add_light(leaf, point, direct, indirect);
    float count = 1.0, near = REACH * min(elements[leaf].half_extent.x, elements[leaf].half_extent.y);
    uint root = elements[leaf].instance, n = root;
    while (true) {
        bool enters = is_near(elements[n], point, near);
        uint children = elements[n].children;
        if (enters && children != NO_FACE_ELEMENT) {
            n = children;
            continue;
        }
        if (enters && n != leaf && dot(elements[n].axis_z, elements[leaf].axis_z) > SAME_SURFACE) {
            add_light(n, point, direct, indirect);
            count += 1.0;
        }
        while (n != root && n != elements[elements[n].parent].children) n = elements[n].parent;
        if (n == root) break;
        ++n;
    }
    direct /= count;
    indirect /= count;
}

void main()
{
    uint e = linear_index();
    if (e >= params.element_count || elements[e].children != NO_FACE_ELEMENT) return;
    mat3 direct[4], indirect[4];
    [[dont_unroll]] for (uint k = 0; k < 4; ++k)
        corner_light(e, plane_point(elements[e], vec2(k & 1u, k >> 1)), direct[k], indirect[k]);
    // What is bilinear between corners, on 1, u, v and uv.
    uint first = leaf_indices[e] * 4;
    [[dont_unroll]] for (uint k = 0; k < 4; ++k) {
        vec4 signs = vec4(1.0);
        if ((k & 1u) != 0) signs *= vec4(-1, 1, -1, 1);
        if ((k & 2u) != 0) signs *= vec4(-1, -1, 1, 1);
        float scale = params.inverse_unit * 0.25 / (k == 3 ? 3.0 : k == 0 ? 1.0 : 1.7320508075688772);
        leaf_direct[first + k] = packed(signs.x * direct[0] + signs.y * direct[1] + signs.z * direct[2] + signs.w * direct[3], scale);
        leaf_indirect[first + k] = packed(signs.x * indirect[0] + signs.y * indirect[1] + signs.z * indirect[2] + signs.w * indirect[3], scale);
    }
}
