#version 460
#include "lib/prelude.glsl"
#include "lib/element_rays.glsl"
#include "lib/ray.glsl"

// One thread per ray of a batch of elements.                                                      [Schmitz2008 3.2]
// reads ray_origins (m), element_normals (unit) [element_count]
// writes rays[batch_count * side^2], element by element, in metres   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer RayOrigins { vec3 ray_origins[]; };
layout(set = 0, binding = 1, scalar) readonly buffer ElementNormals { vec3 element_normals[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Rays { Ray rays[]; };
layout(push_constant, scalar) uniform Params {
    uint first_element;
    uint batch_count;
    uint side;              // multiple of 4
    uint is_rotated;        // every element turns its grid by a shift of its own
} params;

void main()
{
    uint i = linear_index();
    uint per_element = params.side * params.side;
    if (i >= params.batch_count * per_element) return;

    uint element = params.first_element + i / per_element;
    vec2 shift = params.is_rotated != 0 ? element_shift(element) : vec2(0.0);
    vec3 direction = basis_of(element_normals[element]) * element_ray(i % per_element, params.side, shift);
    rays[i] = Ray(ray_origins[element], 0.0, direction, 1e30);
}
