#version 460
#include "lib/prelude.glsl"
#include "lib/environment.glsl"
#include "lib/ray.glsl"
#include "lib/spherical_harmonics.glsl"

// One thread per texel of a batch: what its rays bring from surfaces and from the environment.
// reads rays, hits [batch_count * sample_count], triangles, back_elements (per vertex), exitant (per element, W m^-2 sr^-1),
//       the environment   updates arriving[texel_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Hits { Hit hits[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 3, scalar) readonly buffer BackElements { uint back_elements[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Exitant { vec3 exitant[]; };
layout(set = 0, binding = 5, scalar) readonly buffer EnvironmentInfos { EnvironmentInfo environment_info[]; };
layout(set = 0, binding = 6) uniform sampler2D environment_map;
layout(set = 0, binding = 7, scalar) buffer Arriving { ArrivingLight arriving[]; };
layout(push_constant, scalar) uniform Params {
    uint first_texel;
    uint batch_count;
    uint sample_count;
    uint has_environment;
} params;

const uint NO_ELEMENT = 0xffffffffu;

vec3 environment_texel(ivec2 texel) { return texelFetch(environment_map, texel, 0).rgb; }

// Of the surface's side that was hit, between the elements at its corners; a one-sided back is black.
vec3 seen_radiance(Hit hit)
{
    uvec3 v = triangles[triangle_index(hit)];
    if (is_back_face(hit)) {
        v = uvec3(back_elements[v.x], back_elements[v.y], back_elements[v.z]);
        if (any(equal(v, uvec3(NO_ELEMENT)))) return vec3(0.0);
    }
    return mat3(exitant[v.x], exitant[v.y], exitant[v.z]) * barycentric_weights(hit);
}

void main()
{
    uint i = linear_index();
    if (i >= params.batch_count) return;

    ArrivingLight sum = arriving[params.first_texel + i];
    float solid_angle = 2.0 * PI / float(params.sample_count);
    for (uint k = i * params.sample_count; k < (i + 1) * params.sample_count; ++k) {
        vec3 direction = rays[k].direction;
        vec3 radiance = vec3(0.0);
        if (is_hit(hits[k])) radiance = seen_radiance(hits[k]);
        else if (params.has_environment != 0) radiance = environment_radiance(environment_info[0], direction);
        add_arriving(sum, solid_angle * radiance, direction);
    }
    arriving[params.first_texel + i] = sum;
}
