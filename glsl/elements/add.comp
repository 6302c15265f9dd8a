#version 460
#include "lib/prelude.glsl"

// One thread per element: sum += term.
// reads term[element_count] (W/m2)   updates sum[element_count] (W/m2)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Term { vec3 term[]; };
layout(set = 0, binding = 1, scalar) buffer Sum { vec3 sum[]; };
layout(push_constant, scalar) uniform Params { uint element_count; } params;

void main()
{
    uint element = linear_index();
    if (element >= params.element_count) return;
    sum[element] += term[element];
}
