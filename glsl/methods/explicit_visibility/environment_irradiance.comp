#version 460
#include "lib/prelude.glsl"
#include "lib/environment.glsl"
#include "lib/element_rays.glsl"

// One thread per element: irradiance from the environment through the rays that escaped.          [Schmitz2008 3.2]
// reads element_normals[element_count], escaped[element_count * ceil(side^2 / 32)] (one bit per ray), environment_info[1],
// the map   writes irradiance[element_count] (W/m2)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer ElementNormals { vec3 element_normals[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Escaped { uint escaped[]; };
layout(set = 0, binding = 2, scalar) readonly buffer EnvironmentInfos { EnvironmentInfo environment_info[]; };
layout(set = 0, binding = 3) uniform sampler2D environment_map;
layout(set = 0, binding = 4, scalar) writeonly buffer Irradiance { vec3 irradiance[]; };
layout(push_constant, scalar) uniform Params {
    uint element_count;
    uint side;              // rays a side of the grid
    uint is_rotated;        // as the rays were cast
} params;

vec3 environment_texel(ivec2 texel) { return texelFetch(environment_map, texel, 0).rgb; }

void main()
{
    uint element = linear_index();
    if (element >= params.element_count) return;

    EnvironmentInfo env = environment_info[0];
    mat3 basis = basis_of(element_normals[element]);
    vec2 shift = params.is_rotated != 0 ? element_shift(element) : vec2(0.0);
    uint ray_count = params.side * params.side, words = (ray_count + 31) / 32;
    vec3 sum = vec3(0.0);
    for (uint word = 0; word < words; ++word) {
        uint bits = escaped[element * words + word];
        while (bits != 0) {
            uint bit = findLSB(bits);
            bits &= bits - 1;
            sum += environment_radiance(env, basis * element_ray(word * 32 + bit, params.side, shift));
        }
    }
    // Cosine-weighted rays: each carries pi / side^2 of the radiance it sees.
    irradiance[element] = sum * (PI / float(ray_count));
}
