#version 460
#include "lib/prelude.glsl"
#include "lib/environment.glsl"
#include "lib/random.glsl"
#include "lib/ray.glsl"
#include "lib/texel_gloss.glsl"

// One thread per texel of a batch: what the environment brings along the rays that left the scene, into the table of a shiny
// texel.
// reads texels, glossy_rows, rays, is_free [batch_count * sample_count], the environment
// updates arrived[row_count * side * side] (W/m2)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Texels { AtlasTexel texels[]; };
layout(set = 0, binding = 1, scalar) readonly buffer GlossyRows { uint glossy_rows[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = 3, scalar) readonly buffer IsFree { uint is_free[]; };
layout(set = 0, binding = 4, scalar) readonly buffer EnvironmentInfos { EnvironmentInfo environment_info[]; };
layout(set = 0, binding = 5) uniform sampler2D environment_map;
layout(set = 0, binding = 6, scalar) buffer Arrived { vec3 arrived[]; };
layout(push_constant, scalar) uniform Params { uint first_texel; uint batch_count; uint sample_count; uint side; } params;

vec3 environment_texel(ivec2 texel) { return texelFetch(environment_map, texel, 0).rgb; }

void main()
{
    uint i = linear_index();
    if (i >= params.batch_count) return;

    uint index = params.first_texel + i, row = glossy_rows[index];
    if (row == 0) return;
    AtlasTexel texel = texels[index];
    for (uint ray = i * params.sample_count; ray < (i + 1) * params.sample_count; ++ray) {
        if (is_free[ray] == 0) continue;
        uint k = ray - i * params.sample_count;
        vec3 light = environment_radiance(environment_info[0], rays[ray].direction) * (PI / float(params.sample_count));
        arrived[arrival_entry(texel, row, params.side, rays[ray].direction, unit_interval(pcg4d(uvec4(index, k, 0u, 5u))).xy)] += light;
    }
}
