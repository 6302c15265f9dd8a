#version 460
#include "lib/prelude.glsl"
#include "lib/cluster_basis.glsl"
#include "lib/face_element.glsl"

// One thread per element, of one level after the other from below: the unshot light of an inner element is its
// children's, by area and change of basis.                                                     [Gobbetti2003 3.3.4]
// reads elements   updates next_unshot (W/m2), pool   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Elements { FaceElement elements[]; };
layout(set = 0, binding = 1, scalar) buffer NextUnshot { vec3 next_unshot[]; };     // per element and function
layout(set = 0, binding = 2, scalar) buffer Pool { PoolCounters pool[]; };
layout(constant_id = 0) const uint RADIOSITY_FUNCTIONS = 1u;
layout(push_constant, scalar) uniform Params { uint element_count; uint level; } params;

void main()
{
    uint e = linear_index();
    if (e >= params.element_count || elements[e].level != params.level) return;
    FaceElement element = elements[e];
    if (element.children != NO_FACE_ELEMENT) {
        vec3 sums[MOST_FUNCTIONS];
        for (uint k = 0; k < RADIOSITY_FUNCTIONS; ++k) sums[k] = vec3(0.0);
        for (uint c = element.children; c < element.children + 2; ++c) {
            FaceElement child = elements[c];
            // Power is kept, whatever parts of both were found to be hidden.
            float share = element.area > 0.0 ? child.area / element.area : 0.5;
            for (uint g = 0; g < 16; ++g) {
                vec2 uv = gauss_point(g), place = plane_coordinates(element, plane_point(child, uv));
                vec3 value = vec3(0.0);
                for (uint k = 0; k < RADIOSITY_FUNCTIONS; ++k) value += basis(k, uv) * next_unshot[c * RADIOSITY_FUNCTIONS + k];
                for (uint k = 0; k < RADIOSITY_FUNCTIONS; ++k) sums[k] += share * gauss_weight(g) * basis(k, place) * value;
            }
        }
        for (uint k = 0; k < RADIOSITY_FUNCTIONS; ++k) next_unshot[e * RADIOSITY_FUNCTIONS + k] = sums[k];
    }
    vec3 value = next_unshot[e * RADIOSITY_FUNCTIONS];
    atomicMax(pool[0].largest_unshot, floatBitsToUint(max(0.0, max(value.x, max(value.y, value.z)))));
}
