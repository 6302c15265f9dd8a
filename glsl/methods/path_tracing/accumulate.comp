#version 460
#include "lib/prelude.glsl"
#include "methods/path_tracing/path.glsl"

// One thread per pixel of the tile: adds the samples of a batch, in their order, so that batches of any size give the
// same bits.
// reads direct, indirect [path_count]   updates direct_sum, indirect_sum, even_sum (samples 0, 2, 4 ... of both)
// [pixels] (W m^-2 sr^-1)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Direct { vec3 direct[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Indirect { vec3 indirect[]; };
layout(set = 0, binding = 2, scalar) buffer DirectSum { vec3 direct_sum[]; };
layout(set = 0, binding = 3, scalar) buffer IndirectSum { vec3 indirect_sum[]; };
layout(set = 0, binding = 4, scalar) buffer EvenSum { vec3 even_sum[]; };
layout(push_constant, scalar) uniform Params { Batch batch; } params;

// A sample that left the range of floats must not spoil its pixel for good.
vec3 kept(vec3 radiance)
{
    float sum = radiance.r + radiance.g + radiance.b;
    return sum >= 0.0 && sum < 1e30 ? radiance : vec3(0.0);
}

void main()
{
    uint k = linear_index();
    if (k >= params.batch.pixel_count) return;

    uint pixel = params.batch.first_pixel + k;
    bool is_first = params.batch.first_sample == 0;
    vec3 direct_total = is_first ? vec3(0.0) : direct_sum[pixel];
    vec3 indirect_total = is_first ? vec3(0.0) : indirect_sum[pixel];
    vec3 even_total = is_first ? vec3(0.0) : even_sum[pixel];
    for (uint i = k; i < params.batch.path_count; i += params.batch.pixel_count) {
        vec3 own_direct = kept(direct[i]), own_indirect = kept(indirect[i]);
        direct_total += own_direct;
        indirect_total += own_indirect;
        if (sample_of(params.batch, i) % 2 == 0) even_total += own_direct + own_indirect;
    }
    direct_sum[pixel] = direct_total;
    indirect_sum[pixel] = indirect_total;
    even_sum[pixel] = even_total;
}
