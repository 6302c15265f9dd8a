#version 460
#include "lib/prelude.glsl"
#include "lib/environment.glsl"
#include "lib/ray.glsl"

// One thread per texel of a batch: irradiance from the environment along the rays that left the scene.
// reads rays, is_free [batch_count * sample_count], the environment   updates irradiance[texel_count] (W/m2)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = 1, scalar) readonly buffer IsFree { uint is_free[]; };
layout(set = 0, binding = 2, scalar) readonly buffer EnvironmentInfos { EnvironmentInfo environment_info[]; };
layout(set = 0, binding = 3) uniform sampler2D environment_map;
layout(set = 0, binding = 4, scalar) buffer Irradiance { vec3 irradiance[]; };
layout(push_constant, scalar) uniform Params { uint first_texel; uint batch_count; uint sample_count; } params;

vec3 environment_texel(ivec2 texel) { return texelFetch(environment_map, texel, 0).rgb; }

void main()
{
    uint i = linear_index();
    if (i >= params.batch_count) return;
    vec3 sum = vec3(0.0);
    for (uint ray = i * params.sample_count; ray < (i + 1) * params.sample_count; ++ray)
        if (is_free[ray] != 0) sum += environment_radiance(environment_info[0], rays[ray].direction);
    irradiance[params.first_texel + i] += sum * (PI / float(params.sample_count));
}
