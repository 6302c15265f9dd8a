#version 460
#include "lib/prelude.glsl"
#include "lib/face_element.glsl"

// One thread per element: a leaf shoots next what it reflects of what arrived: B = rho n.E, with the mean normal of all
// faces, shorter than 1 where they differ.                                                     [Gobbetti2003 Eq. 9]
// reads elements, arriving (bits of floats, W/m2), function_means   updates next_unshot   shared none
// Differs from [Gobbetti2003]: an even radiosity is the mean over the faces, not over the square around them.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Elements { FaceElement elements[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Arriving { int arriving[]; };      // per element, function, channel, axis
layout(set = 0, binding = 2, scalar) readonly buffer FunctionMeans { float function_means[]; };     // per element and function
layout(set = 0, binding = 3, scalar) buffer NextUnshot { vec3 next_unshot[]; };         // per element and function, W/m2
layout(constant_id = 0) const uint IRRADIANCE_FUNCTIONS = 3u;
layout(constant_id = 1) const uint RADIOSITY_FUNCTIONS = 1u;
layout(push_constant, scalar) uniform Params { uint element_count; } params;

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
    uint e = linear_index();
    if (e >= params.element_count || elements[e].children != NO_FACE_ELEMENT) return;
    FaceElement element = elements[e];
    vec3 normal = element.axis_z * (vector_area(element) / max(element.area, 1e-30));
    mat3 mean = arrived(e, 0);
    if (RADIOSITY_FUNCTIONS == 1)
        for (uint k = 1; k < IRRADIANCE_FUNCTIONS; ++k) mean += function_means[e * IRRADIANCE_FUNCTIONS + k] * arrived(e, k);
    for (uint k = 0; k < RADIOSITY_FUNCTIONS; ++k) {
        vec3 reflected = element.albedo * (normal * (k == 0 ? mean : arrived(e, k)));
        next_unshot[e * RADIOSITY_FUNCTIONS + k] += k == 0 ? max(reflected, vec3(0.0)) : reflected;
    }
}
