#ifndef LIB_RANDOM
#define LIB_RANDOM
// Random numbers without state: each is a hash of what it is for.                        [Jarzynski2020, pcg4d]

uvec4 pcg4d(uvec4 v)
{
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> 16u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// Four numbers in [0, 1), multiples of 2^-24, for one dimension (four to a dimension) of one sample of one pixel.
vec4 random4(uint pixel, uint sample_index, uint dimension, uint seed)
{
    return vec4(pcg4d(uvec4(pixel, sample_index, dimension, seed)) >> 8u) * (1.0 / 16777216.0);
}
#endif
