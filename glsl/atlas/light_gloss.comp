#version 460
#include "lib/prelude.glsl"
#include "lib/light.glsl"
#include "lib/random.glsl"
#include "lib/ray.glsl"
#include "lib/texel_gloss.glsl"

// One thread per texel of a batch: what one punctual light brings, into the table of a shiny texel.
// reads texels, glossy_rows, lights, rays, is_free [batch_count * sample_count]
// updates arrived[row_count * side * side] (W/m2)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Texels { AtlasTexel texels[]; };
layout(set = 0, binding = 1, scalar) readonly buffer GlossyRows { uint glossy_rows[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Lights { Light lights[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = 4, scalar) readonly buffer IsFree { uint is_free[]; };
layout(set = 0, binding = 5, scalar) buffer Arrived { vec3 arrived[]; };
layout(push_constant, scalar) uniform Params {
    uint first_texel;
    uint batch_count;
    uint sample_count;
    uint light;
    uint side;
} params;

void main()
{
    uint i = linear_index();
    if (i >= params.batch_count) return;

    uint index = params.first_texel + i, row = glossy_rows[index];
    if (row == 0) return;
    AtlasTexel texel = texels[index];
    for (uint ray = i * params.sample_count; ray < (i + 1) * params.sample_count; ++ray) {
        if (rays[ray].t_max < 0.0 || is_free[ray] == 0) continue;
        vec3 to_light;
        float distance_to_light;
        vec3 arriving = light_irradiance(lights[params.light], rays[ray].origin, to_light, distance_to_light);
        uint k = ray - i * params.sample_count;
        uint entry = arrival_entry(texel, row, params.side, to_light, unit_interval(pcg4d(uvec4(index, k, params.light, 4u))).xy);
        arrived[entry] += arriving * (max(dot(texel.normal, to_light), 0.0) / float(params.sample_count));
    }
}
