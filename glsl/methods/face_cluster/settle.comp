#version 460
#include "lib/prelude.glsl"
#include "lib/cluster_basis.glsl"
#include "lib/face_element.glsl"

// One thread per element and function, of one level after the other: adds what the element's parent passes down (by
// change of basis, a vector only where it lies in the element's half-space) to what it got itself. A leaf keeps it.
//                                                                                    [Gobbetti2003 3.3.4, Alg. 1]
// reads elements   updates arriving (whole units; from here on bits of floats, W/m2), direct or indirect irradiance
// shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Elements { FaceElement elements[]; };
layout(set = 0, binding = 1, scalar) buffer Arriving { int arriving[]; };               // per element, function, channel, axis
layout(set = 0, binding = 2, scalar) buffer Irradiance { mat3 irradiance[]; };          // per element and function; a column a channel
layout(constant_id = 0) const uint IRRADIANCE_FUNCTIONS = 3u;
layout(push_constant, scalar) uniform Params {
    uint element_count;
    uint level;
    float inverse_units;    // W/m2
    uint is_kept;           // 0: for reflection alone; punctual light is shown per pixel
} params;

mat3 arrived(uint element, uint k)
{
    mat3 value;
    uint first = (element * IRRADIANCE_FUNCTIONS + k) * 9;
    for (uint c = 0; c < 3; ++c)
        value[c] = intBitsToFloat(ivec3(arriving[first + 3 * c], arriving[first + 3 * c + 1], arriving[first + 3 * c + 2]));
    return value;
}

void main()
{
    uint i = linear_index();
    if (i >= params.element_count * IRRADIANCE_FUNCTIONS) return;
    uint e = i / IRRADIANCE_FUNCTIONS, k = i % IRRADIANCE_FUNCTIONS;
    if (elements[e].level != params.level) return;
    FaceElement element = elements[e];

    // Whole units until here.
    mat3 sum;
    for (uint c = 0; c < 3; ++c)
        sum[c] = vec3(arriving[i * 9 + 3 * c], arriving[i * 9 + 3 * c + 1], arriving[i * 9 + 3 * c + 2]) * params.inverse_units;

    if (element.parent != NO_FACE_ELEMENT) {
        FaceElement parent = elements[element.parent];
        mat3 pushed = mat3(0.0), constant = mat3(0.0);
        [[dont_unroll]] for (uint g = 0; g < 16; ++g) {
            vec2 uv = gauss_point(g), place = plane_coordinates(parent, plane_point(element, uv));
            mat3 value = mat3(0.0);
            [[dont_unroll]] for (uint j = 0; j < IRRADIANCE_FUNCTIONS; ++j) value += basis(j, place) * arrived(element.parent, j);
            constant += gauss_weight(g) * value;
            pushed += gauss_weight(g) * basis(k, uv) * value;
        }
        vec3 along = element.axis_z * constant;
        for (uint c = 0; c < 3; ++c)
            if (along[c] > 0.0) sum[c] += pushed[c];
    }
    for (uint c = 0; c < 3; ++c)
        for (uint axis = 0; axis < 3; ++axis) arriving[i * 9 + 3 * c + axis] = floatBitsToInt(sum[c][axis]);
    if (element.children != NO_FACE_ELEMENT) return;

    if (params.is_kept != 0) irradiance[i] += sum;
}
