#ifndef LIB_SHARED_EXPONENT
#define LIB_SHARED_EXPONENT
// Colours as three mantissas and one exponent, so that one load fetches all: in 64 bits (18 bits a channel, off by 2^-19
// of the brightest channel at most) or in 32 (8 bits, 2^-9). Any finite colour that is not negative; below 1e-30 is black.

// Such that every channel is less than 2^exponent.
int shared_exponent(vec3 color)
{
    float largest = min(max(color.r, max(color.g, color.b)), 3e38);
    return largest > 1e-30 ? int(floatBitsToUint(largest) >> 23) - 126 : -127;
}

// Channels as integers of so many bits; black where the exponent says so.
uvec3 mantissas(vec3 color, int exponent, int bits)
{
    if (exponent == -127) return uvec3(0);
    // In two steps: the scale alone may lie beyond what a float can hold.
    vec3 fraction = ldexp(min(color, vec3(3e38)), ivec3(-exponent));
    return min(uvec3(fraction * float(1 << bits) + 0.5), uvec3((1 << bits) - 1));
}

// 2^(exponent - bits) by its bits.
uint scale_field(int exponent, int bits) { return exponent == -127 ? 1 : uint(exponent - bits + 127); }

// R 18, G's upper 14 | G's lower 4, B 18, scale 10.
uvec2 encode_64(vec3 color)
{
    int exponent = shared_exponent(color);
    uvec3 m = mantissas(color, exponent, 18);
    return uvec2(m.r << 14 | m.g >> 4, m.g << 28 | m.b << 10 | scale_field(exponent, 18));
}

vec3 decode_64(uvec2 word)
{
    vec3 m = vec3(word.x >> 14, (word.x & 0x3fffu) << 4 | word.y >> 28, word.y >> 10 & 0x3ffffu);
    return uintBitsToFloat((word.y & 0x3ffu) << 23) * m;
}

// R 8, G 8, B 8, scale 8.
uint encode_32(vec3 color)
{
    int exponent = shared_exponent(color);
    uvec3 m = mantissas(color, exponent, 8);
    return m.r << 24 | m.g << 16 | m.b << 8 | scale_field(exponent, 8);
}

vec3 decode_32(uint word)
{
    return uintBitsToFloat((word & 0xffu) << 23) * vec3(word >> 24, word >> 16 & 0xffu, word >> 8 & 0xffu);
}
#endif
