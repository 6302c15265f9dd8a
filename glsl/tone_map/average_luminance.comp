#version 460
#include "lib/prelude.glsl"

// One workgroup: folds the sums of all blocks into the floor of luminance (1e-4 of its mean), or into the logarithmic
// average; 0 where nothing is lit.                                       [Reinhard2002, Eq. 1] as report::tonemap has it
// reads sums[block_count]   updates average[2]   shared 512 words
layout(local_size_x = 256) in;
layout(set = 0, binding = 0, scalar) readonly buffer Sums { vec2 sums[]; };    // count, sum
layout(set = 0, binding = 1, scalar) buffer Average { float average[]; };      // floor, log average
layout(push_constant, scalar) uniform Params { uint block_count; uint is_logarithm; } params;

shared vec2 sh_sums[256];

void main()
{
    uint thread = gl_LocalInvocationID.x;
    vec2 own = vec2(0.0);
    for (uint block = thread; block < params.block_count; block += 256) own += sums[block];
    sh_sums[thread] = own;
    barrier();
    for (uint half_count = 128; half_count > 0; half_count /= 2) {
        if (thread < half_count) sh_sums[thread] += sh_sums[thread + half_count];
        barrier();
    }
    if (thread != 0) return;
    vec2 total = sh_sums[0];
    if (params.is_logarithm != 0) average[1] = total.x > 0.0 ? exp(total.y / total.x) : 0.0;
    else average[0] = total.x > 0.0 ? 1e-4 * total.y / total.x : 0.0;
}
