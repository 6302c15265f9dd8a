#version 460
#include "lib/prelude.glsl"
#include "lib/face_element.glsl"

// One thread per element: its emission is what it is to shoot first.                          [Gobbetti2003 Alg. 1]
// reads elements   writes unshot (W/m2)   updates pool   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Elements { FaceElement elements[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Unshot { vec3 unshot[]; };
layout(set = 0, binding = 2, scalar) buffer Pool { PoolCounters pool[]; };
layout(push_constant, scalar) uniform Params { uint element_count; uint radiosity_functions; } params;

void main()
{
    uint e = linear_index();
    if (e >= params.element_count) return;
    vec3 emitted = PI * elements[e].emission;
    for (uint k = 0; k < params.radiosity_functions; ++k)
        unshot[e * params.radiosity_functions + k] = k == 0 ? emitted : vec3(0.0);
    atomicMax(pool[0].largest_unshot, floatBitsToUint(max(emitted.x, max(emitted.y, emitted.z))));
}
