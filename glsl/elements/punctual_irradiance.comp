#version 460
#include "lib/prelude.glsl"
#include "lib/light.glsl"

// One thread per element: irradiance from all punctual lights through their stored visibility.   [Schmitz2008 3.3, Eq. 2]
// reads element_positions, element_normals [element_count], lights[light_count], visibility[light_count * element_count] (0..1)
// writes irradiance[element_count] (W/m2)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer ElementPositions { vec3 element_positions[]; };
layout(set = 0, binding = 1, scalar) readonly buffer ElementNormals { vec3 element_normals[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Lights { Light lights[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Visibility { float visibility[]; };    // light-major
layout(set = 0, binding = 4, scalar) writeonly buffer Irradiance { vec3 irradiance[]; };
layout(push_constant, scalar) uniform Params { uint element_count; uint light_count; } params;

void main()
{
    uint element = linear_index();
    if (element >= params.element_count) return;

    vec3 position = element_positions[element], normal = element_normals[element];
    vec3 sum = vec3(0.0);
    for (uint light = 0; light < params.light_count; ++light) {
        vec3 to_light;
        float distance_to_light;
        vec3 arriving = light_irradiance(lights[light], position, to_light, distance_to_light);
        sum += arriving * (max(dot(normal, to_light), 0.0) * visibility[light * params.element_count + element]);
    }
    irradiance[element] = sum;
}
