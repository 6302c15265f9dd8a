#version 460
#include "lib/prelude.glsl"

// One thread per pixel: the means of all samples so far.
// reads the sums [pixel_count]   writes direct, indirect (W m^-2 sr^-1), albedo, normal, depth (m) [pixel_count]
// shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer DirectSum { vec3 direct_sum[]; };
layout(set = 0, binding = 1, scalar) readonly buffer IndirectSum { vec3 indirect_sum[]; };
layout(set = 0, binding = 2, scalar) readonly buffer AlbedoSum { vec3 albedo_sum[]; };
layout(set = 0, binding = 3, scalar) readonly buffer NormalSum { vec3 normal_sum[]; };
layout(set = 0, binding = 4, scalar) readonly buffer DepthSum { vec2 depth_sum[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer Direct { vec3 direct[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer Indirect { vec3 indirect[]; };
layout(set = 0, binding = 7, scalar) writeonly buffer Albedo { vec3 albedo[]; };
layout(set = 0, binding = 8, scalar) writeonly buffer Normal { vec3 normal[]; };
layout(set = 0, binding = 9, scalar) writeonly buffer Depth { float depth[]; };
layout(push_constant, scalar) uniform Params { uint pixel_count; uint sample_count; } params;

void main()
{
    uint pixel = linear_index();
    if (pixel >= params.pixel_count) return;

    float count = float(params.sample_count);
    direct[pixel] = direct_sum[pixel] / count;
    indirect[pixel] = indirect_sum[pixel] / count;
    albedo[pixel] = albedo_sum[pixel] / count;
    normal[pixel] = normal_sum[pixel] / count;
    vec2 seen = depth_sum[pixel];
    depth[pixel] = seen.y > 0.0 ? seen.x / seen.y : 0.0;
}
