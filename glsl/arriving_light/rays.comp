#version 460
#include "lib/prelude.glsl"
#include "lib/atlas.glsl"
#include "lib/hemisphere.glsl"
#include "lib/random.glsl"
#include "lib/ray.glsl"

// One thread per texel of a batch and sample: a ray from the texel, all directions of its hemisphere alike.
// reads texels   writes rays[batch_count * sample_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Texels { AtlasTexel texels[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Rays { Ray rays[]; };
layout(push_constant, scalar) uniform Params {
    uint first_texel;
    uint batch_count;
    uint sample_count;
    uint seed;
    float ray_offset;       // m
} params;

void main()
{
    uint i = linear_index();
    if (i >= params.batch_count * params.sample_count) return;

    uint index = params.first_texel + i / params.sample_count, k = i % params.sample_count;
    AtlasTexel texel = texels[index];
    vec2 u = unit_interval(even_point(k, pcg4d(uvec4(index, 0u, 1u, params.seed))));
    float across = sqrt(max(1.0 - u.x * u.x, 0.0)), turn = 2.0 * PI * u.y;
    vec3 direction = basis_of(texel.normal) * vec3(across * cos(turn), across * sin(turn), u.x);
    rays[i] = Ray(texel_point(texel, k) + params.ray_offset * texel.normal, 0.0, direction, 3e38);
}
