#version 460
#include "lib/prelude.glsl"

// One thread per value: what the device can compute at most. Chains of multiply-adds that do not wait for each other.
// Flops of a thread: iterations * CHAINS * 4 lanes * 2.
// updates values[count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) buffer Values { float values[]; };
layout(push_constant, scalar) uniform Params { uint count; uint iterations; } params;

void main()
{
    uint i = linear_index();
    if (i >= params.count) return;

    // Stays finite: |0.999| < 1.
    float start = values[i];
    vec4 a = vec4(start), b = a + 1.0, c = a + 2.0, d = a + 3.0;
    for (uint k = 0; k < params.iterations; ++k) {
        a = fma(a, vec4(0.999), vec4(0.001));
        b = fma(b, vec4(0.999), vec4(0.001));
        c = fma(c, vec4(0.999), vec4(0.001));
        d = fma(d, vec4(0.999), vec4(0.001));
    }
    vec4 sum = a + b + c + d;
    values[i] = sum.x + sum.y + sum.z + sum.w;
}
