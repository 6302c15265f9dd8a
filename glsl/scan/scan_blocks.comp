#version 460
#include "lib/prelude.glsl"

// One workgroup per block of 1024 values: exclusive prefix sums within the block, and the block's total.
//                                                                                          [Blelloch1990 work-efficient form]
// updates values[value_count]   writes block_sums[ceil(value_count / 1024)]   shared 256 words
layout(local_size_x = 256) in;
layout(set = 0, binding = 0, scalar) buffer Values { uint values[]; };                  // value_count
layout(set = 0, binding = 1, scalar) writeonly buffer BlockSums { uint block_sums[]; }; // one per block of 1024
layout(push_constant, scalar) uniform Params { uint value_count; } params;

shared uint sh_sums[256];

void main()
{
    uint block = gl_WorkGroupID.x + gl_WorkGroupID.y * gl_NumWorkGroups.x;
    uint first = block * 1024 + gl_LocalInvocationID.x * 4;

    // Sum four neighbours per thread.
    uint own[4];
    uint total = 0;
    for (uint k = 0; k < 4; ++k) {
        own[k] = total;
        total += first + k < params.value_count ? values[first + k] : 0;
    }

    // Scan the sums of the threads (Hillis and Steele: few steps, no bank conflicts to care about at this size).
    uint thread = gl_LocalInvocationID.x;
    sh_sums[thread] = total;
    barrier();
    for (uint offset = 1; offset < 256; offset *= 2) {
        uint before = thread >= offset ? sh_sums[thread - offset] : 0;
        barrier();
        sh_sums[thread] += before;
        barrier();
    }

    uint base = sh_sums[thread] - total;
    for (uint k = 0; k < 4; ++k)
        if (first + k < params.value_count) values[first + k] = base + own[k];
    if (thread == 255 && block * 1024 < params.value_count) block_sums[block] = sh_sums[255];
}
