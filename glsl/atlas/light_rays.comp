#version 460
#include "lib/prelude.glsl"
#include "lib/atlas.glsl"
#include "lib/light.glsl"
#include "lib/ray.glsl"

// One thread per texel of a batch and sample: a shadow ray from a point of the texel towards one punctual light.
// reads texels, lights   writes rays[batch_count * sample_count] (inactive behind the horizon)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Texels { AtlasTexel texels[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Lights { Light lights[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Rays { Ray rays[]; };
layout(push_constant, scalar) uniform Params {
    uint first_texel;
    uint batch_count;
    uint sample_count;
    uint light;
    float ray_offset;       // m
} params;

void main()
{
    uint i = linear_index();
    if (i >= params.batch_count * params.sample_count) return;

    AtlasTexel texel = texels[params.first_texel + i / params.sample_count];
    vec3 origin = texel_point(texel, i % params.sample_count) + params.ray_offset * texel.normal;
    vec3 to_light;
    float distance_to_light;
    light_irradiance(lights[params.light], origin, to_light, distance_to_light);
    bool is_lit = dot(texel.normal, to_light) > 0.0;
    rays[i] = Ray(origin, 0.0, to_light, is_lit ? distance_to_light : -1.0);
}
