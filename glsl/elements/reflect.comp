#version 460
#include "lib/prelude.glsl"

// One thread per element: what arrives leaves again by the albedo.                                [Schmitz2008 3.3, Eq. 4]
// reads irradiance (W/m2), albedo [element_count]   writes radiosity[element_count] (W/m2)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Irradiance { vec3 irradiance[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Albedo { vec3 albedo[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Radiosity { vec3 radiosity[]; };
layout(push_constant, scalar) uniform Params { uint element_count; } params;

void main()
{
    uint element = linear_index();
    if (element >= params.element_count) return;
    radiosity[element] = albedo[element] * irradiance[element];
}
