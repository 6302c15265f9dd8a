#version 460
#include "lib/prelude.glsl"

// One thread per value: adds the scanned sum of the blocks before its own.                 [Blelloch1990]
// reads block_sums[ceil(value_count / 1024)], scanned   updates values[value_count]   shared none
layout(local_size_x = 256) in;
layout(set = 0, binding = 0, scalar) buffer Values { uint values[]; };                 // value_count
layout(set = 0, binding = 1, scalar) readonly buffer BlockSums { uint block_sums[]; }; // one per block of 1024
layout(push_constant, scalar) uniform Params { uint value_count; } params;

void main()
{
    uint i = linear_index();
    if (i >= params.value_count) return;
    values[i] += block_sums[i / 1024];
}
