#version 460
#include "lib/prelude.glsl"
#include "lib/film.glsl"

// One workgroup per block of 4096 pixels: how many are lit, and the sum of their luminance or of its logarithm.
//                                                                                                  [Reinhard2002, Eq. 1]
// reads direct, indirect [pixel_count], average[2]   writes sums[ceil(pixel_count / 4096)]   shared 512 words
layout(local_size_x = 256) in;
layout(set = 0, binding = 0, scalar) readonly buffer Direct { vec3 direct[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Indirect { vec3 indirect[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Average { float average[]; };     // floor, log average
layout(set = 0, binding = 3, scalar) writeonly buffer Sums { vec2 sums[]; };           // count, sum
layout(push_constant, scalar) uniform Params {
    uint pixel_count;
    uint light_parts;
    uint is_logarithm;  // with luminance floored at average[0]
} params;

shared vec2 sh_sums[256];

void main()
{
    uint thread = gl_LocalInvocationID.x;
    uint block = gl_WorkGroupID.x + gl_WorkGroupID.y * gl_NumWorkGroups.x;
    vec2 own = vec2(0.0);
    for (uint k = 0; k < 16; ++k) {
        uint pixel = block * 4096 + k * 256 + thread;
        if (pixel >= params.pixel_count) break;
        vec3 light = shown_light(direct[pixel], indirect[pixel], params.light_parts);
        float luminance = luminance_of(light);
        if (!is_finite(light) || luminance <= 0.0) continue;
        own += vec2(1.0, params.is_logarithm != 0 ? log(max(luminance, average[0])) : luminance);
    }

    // The same order of additions each time.
    sh_sums[thread] = own;
    barrier();
    for (uint half_count = 128; half_count > 0; half_count /= 2) {
        if (thread < half_count) sh_sums[thread] += sh_sums[thread + half_count];
        barrier();
    }
    if (thread == 0 && block * 4096 < params.pixel_count) sums[block] = sh_sums[0];
}
