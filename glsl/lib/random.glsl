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

// Permutes the values of x so that each bit depends on the seed and on lower bits only: Owen's scrambling with the
// bits reversed.                                                                                 [Burley2020 Listing 2]
uint scrambled_upwards(uint x, uint seed)
{
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16u) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

uint scrambled(uint x, uint seed) { return bitfieldReverse(scrambled_upwards(bitfieldReverse(x), seed)); }

// Points that fill the square evenly: any 4^k in a row put one into each of 4^k cells of equal sides. Point `index` of
// Sobol's first two dimensions, in an order and with digits shuffled by `seeds`. Words: fractions of 2^32.
uvec2 even_point(uint index, uvec4 seeds)
{
    index = scrambled(index, seeds.x);
    uint second = 0u, column = 0x80000000u;
    for (uint bits = index; bits != 0u; bits >>= 1u) {
        if ((bits & 1u) != 0u) second ^= column;
        column ^= column >> 1u;
    }
    return uvec2(scrambled(bitfieldReverse(index), seeds.y), scrambled(second, seeds.z));
}

// Four words, uniform over all values, for one dimension (four to a dimension) of one sample of one pixel. Over the
// samples of a pixel xy fill a square evenly, and so do zw, apart from it. Samples of even and of odd index are
// independent of each other: two halves of a picture tell its error.
uvec4 sample_words(uint pixel, uint sample_index, uint dimension, uint seed)
{
    uint stream = 4u * dimension + 2u * (sample_index & 1u);
    uvec2 first = even_point(sample_index >> 1u, pcg4d(uvec4(pixel, stream, 0u, seed)));
    uvec2 second = even_point(sample_index >> 1u, pcg4d(uvec4(pixel, stream + 1u, 0u, seed)));
    return uvec4(first, second);
}

// Words to multiples of 2^-24 in [0, 1).
vec4 unit_interval(uvec4 words) { return vec4(words >> 8u) * (1.0 / 16777216.0); }
vec2 unit_interval(uvec2 words) { return vec2(words >> 8u) * (1.0 / 16777216.0); }
float unit_interval(uint word) { return float(word >> 8u) * (1.0 / 16777216.0); }
#endif
