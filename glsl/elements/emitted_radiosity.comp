#version 460
#include "lib/prelude.glsl"

// One thread per element: radiosity of what it emits, where its light is carried by links. Emitters that are sampled send
// theirs to every element directly and must not do so twice.                                      [Schmitz2008 3.3]
// reads emission[element_count] (W m^-2 sr^-1), is_sampled[element_count]   writes radiosity[element_count] (W/m2)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Emission { vec3 emission[]; };
layout(set = 0, binding = 1, scalar) readonly buffer IsSampled { uint is_sampled[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Radiosity { vec3 radiosity[]; };
layout(push_constant, scalar) uniform Params { uint element_count; } params;

#include "lib/hemisphere.glsl"

void main()
{
    uint element = linear_index();
    if (element >= params.element_count) return;
    radiosity[element] = is_sampled[element] != 0 ? vec3(0.0) : PI * emission[element];
}
