#version 460
#include "lib/prelude.glsl"
#include "lib/hemisphere.glsl"
#include "lib/random.glsl"
#include "lib/ray.glsl"

// One thread per part of a texel and sample: a ray that looks what is in front of the part, cosine-weighted.
// reads points, normals [part_count] (m, unit)   writes rays[batch_count * sample_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Points { vec3 points[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Normals { vec3 normals[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Rays { Ray rays[]; };
layout(push_constant, scalar) uniform Params {
    uint first_part;
    uint batch_count;
    uint sample_count;
    float ray_offset;       // m
} params;

void main()
{
    uint i = linear_index();
    if (i >= params.batch_count * params.sample_count) return;

    uint part = params.first_part + i / params.sample_count, k = i % params.sample_count;
    vec3 normal = normals[part];
    vec2 u = unit_interval(even_point(k, pcg4d(uvec4(part, 1u, 0u, 0u))));
    rays[i] = Ray(points[part] + params.ray_offset * normal, 0.0, basis_of(normal) * cosine_hemisphere(u), 3e38);
}
