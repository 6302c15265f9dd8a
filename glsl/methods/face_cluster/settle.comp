#version 460
#include "lib/prelude.glsl"
#include "lib/cluster_basis.glsl"
#include "lib/face_element.glsl"

// One thread per element, of one level after the other: adds what its parent passes down (by change of basis, a vector
// only where it lies in the element's half-space) to what it got itself. A leaf keeps it and reflects it next.
//                                                                                    [Gobbetti2003 3.3.4, Alg. 1]
// reads elements   updates arriving (whole units; from here on bits of floats, W/m2), direct or indirect irradiance,
// next_unshot   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Elements { FaceElement elements[]; };
layout(set = 0, binding = 1, scalar) buffer Arriving { int arriving[]; };               // per element, function, channel, axis
layout(set = 0, binding = 2, scalar) buffer Irradiance { mat3 irradiance[]; };          // per element and function; a column a channel
layout(set = 0, binding = 3, scalar) buffer NextUnshot { vec3 next_unshot[]; };         // per element and function, W/m2
layout(constant_id = 0) const uint IRRADIANCE_FUNCTIONS = 3u;
layout(constant_id = 1) const uint RADIOSITY_FUNCTIONS = 1u;
layout(push_constant, scalar) uniform Params {
    uint element_count;
    uint level;
    float inverse_units;    // W/m2
    uint is_kept;           // 0: for reflection alone; punctual light is shown per pixel
} params;

void main()
{
    uint e = linear_index();
    if (e >= params.element_count || elements[e].level != params.level) return;
    FaceElement element = elements[e];

    mat3 sums[MOST_FUNCTIONS];
    for (uint k = 0; k < IRRADIANCE_FUNCTIONS; ++k)
        for (uint w = 0; w < 9; ++w)
            sums[k][w / 3][w % 3] = float(arriving[(e * IRRADIANCE_FUNCTIONS + k) * 9 + w]) * params.inverse_units;

    if (element.parent != NO_FACE_ELEMENT) {
        FaceElement parent = elements[element.parent];
        mat3 above[MOST_FUNCTIONS], pushed[MOST_FUNCTIONS];
        for (uint k = 0; k < IRRADIANCE_FUNCTIONS; ++k) {
            pushed[k] = mat3(0.0);
            for (uint w = 0; w < 9; ++w)
                above[k][w / 3][w % 3] = intBitsToFloat(arriving[(element.parent * IRRADIANCE_FUNCTIONS + k) * 9 + w]);
        }
        for (uint g = 0; g < 16; ++g) {
            vec2 uv = gauss_point(g), place = plane_coordinates(parent, plane_point(element, uv));
            mat3 value = mat3(0.0);
            for (uint k = 0; k < IRRADIANCE_FUNCTIONS; ++k) value += basis(k, place) * above[k];
            for (uint k = 0; k < IRRADIANCE_FUNCTIONS; ++k) pushed[k] += gauss_weight(g) * basis(k, uv) * value;
        }
        vec3 along = element.axis_z * pushed[0];
        for (uint k = 0; k < IRRADIANCE_FUNCTIONS; ++k)
            for (uint channel = 0; channel < 3; ++channel)
                if (along[channel] > 0.0) sums[k][channel] += pushed[k][channel];
    }
    for (uint k = 0; k < IRRADIANCE_FUNCTIONS; ++k)
        for (uint w = 0; w < 9; ++w)
            arriving[(e * IRRADIANCE_FUNCTIONS + k) * 9 + w] = floatBitsToInt(sums[k][w / 3][w % 3]);
    if (element.children != NO_FACE_ELEMENT) return;

    // B = rho n.E, with the mean normal of all faces, shorter than 1 where they differ.        [Gobbetti2003 Eq. 9]
    vec3 normal = element.axis_z * (vector_area(element) / max(element.area, 1e-30));
    for (uint k = 0; k < IRRADIANCE_FUNCTIONS; ++k) {
        if (params.is_kept != 0) irradiance[e * IRRADIANCE_FUNCTIONS + k] += sums[k];
        if (k >= RADIOSITY_FUNCTIONS) continue;
        vec3 reflected = element.albedo * (normal * sums[k]);
        next_unshot[e * RADIOSITY_FUNCTIONS + k] += k == 0 ? max(reflected, vec3(0.0)) : reflected;
    }
}
