#version 460
#include "lib/prelude.glsl"
#include "lib/ray.glsl"
#include "methods/path_tracing/path.glsl"

// One thread per pixel of the tile: adds what the camera's rays of a batch see first.
// reads hits, vertices [path_count]   updates albedo_sum, normal_sum, depth_sum (m, and rays that hit) [pixels]
// shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Hits { Hit hits[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Vertices { PathVertex vertices[]; };
layout(set = 0, binding = 2, scalar) buffer AlbedoSum { vec3 albedo_sum[]; };
layout(set = 0, binding = 3, scalar) buffer NormalSum { vec3 normal_sum[]; };
layout(set = 0, binding = 4, scalar) buffer DepthSum { vec2 depth_sum[]; };
layout(push_constant, scalar) uniform Params { Batch batch; } params;

void main()
{
    uint k = linear_index();
    if (k >= params.batch.pixel_count) return;

    uint pixel = params.batch.first_pixel + k;
    bool is_first = params.batch.first_sample == 0;
    vec3 albedo = is_first ? vec3(0.0) : albedo_sum[pixel];
    vec3 normal = is_first ? vec3(0.0) : normal_sum[pixel];
    vec2 depth = is_first ? vec2(0.0) : depth_sum[pixel];
    for (uint i = k; i < params.batch.path_count; i += params.batch.pixel_count) {
        if (!is_hit(hits[i])) continue;
        albedo += vertices[i].albedo;
        normal += vertices[i].normal;
        depth += vec2(hits[i].t, 1.0);
    }
    albedo_sum[pixel] = albedo;
    normal_sum[pixel] = normal;
    depth_sum[pixel] = depth;
}
