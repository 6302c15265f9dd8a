#version 460
#include "lib/prelude.glsl"
#include "lib/atlas.glsl"
#include "lib/light.glsl"
#include "lib/ray.glsl"
#include "lib/spherical_harmonics.glsl"

// One thread per texel of a batch: what one punctual light brings, mean over the texel's points.
// reads lights, rays, is_free [batch_count * sample_count]   updates arriving[texel_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Lights { Light lights[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = 2, scalar) readonly buffer IsFree { uint is_free[]; };
layout(set = 0, binding = 3, scalar) buffer Arriving { ArrivingLight arriving[]; };
layout(push_constant, scalar) uniform Params {
    uint first_texel;
    uint batch_count;
    uint sample_count;
    uint light;
} params;

void main()
{
    uint i = linear_index();
    if (i >= params.batch_count) return;

    ArrivingLight sum = arriving[params.first_texel + i];
    for (uint ray = i * params.sample_count; ray < (i + 1) * params.sample_count; ++ray) {
        if (rays[ray].t_max < 0.0 || is_free[ray] == 0) continue;
        vec3 to_light;
        float distance_to_light;
        vec3 irradiance = light_irradiance(lights[params.light], rays[ray].origin, to_light, distance_to_light);
        add_arriving(sum, irradiance / float(params.sample_count), to_light);
    }
    arriving[params.first_texel + i] = sum;
}
