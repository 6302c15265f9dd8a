#ifndef LIB_LEAF_ELEMENT
#define LIB_LEAF_ELEMENT
// What is kept of the leaves of face-cluster radiosity: where they lie, and their light in three words a function.
const uint NO_LEAF = 0xffffffffu;

struct LeafElement {
    vec3 center;            // metres, world
    vec3 axis_x;            // unit
    vec3 axis_y;
    vec3 half_extent;       // metres along them, and across
};

vec2 plane_coordinates(LeafElement e, vec3 point)
{
    vec3 d = point - e.center;
    return 0.5 + 0.5 * vec2(dot(d, e.axis_x), dot(d, e.axis_y)) / max(e.half_extent.xy, vec2(1e-30));
}

// Irradiance vectors of the three channels with one exponent, in a unit that they fit: a word a channel, of ten bits an
// axis and two of the exponent. Off by less than 1/512 of the largest.
struct SharedVectors {
    uint words[3];
};
const int LEAST_EXPONENT = -48;

SharedVectors packed(mat3 vectors, float inverse_unit)
{
    mat3 v = inverse_unit * vectors;
    vec3 most = max(abs(v[0]), max(abs(v[1]), abs(v[2])));
    // The largest is less than 2^exponent.
    int exponent = clamp(int(floatBitsToUint(max(most.x, max(most.y, most.z))) >> 23) - 126, LEAST_EXPONENT, LEAST_EXPONENT + 63);
    float scale = uintBitsToFloat(uint(127 + 9 - exponent) << 23);
    uint exponent_bits = uint(exponent - LEAST_EXPONENT);
    SharedVectors s;
    for (uint c = 0; c < 3; ++c) {
        uvec3 m = uvec3(clamp(ivec3(round(v[c] * scale)), -512, 511)) & 0x3ffu;
        s.words[c] = m.x | m.y << 10 | m.z << 20 | (exponent_bits >> 2 * c & 3u) << 30;
    }
    return s;
}

mat3 unpacked(SharedVectors s, float unit)
{
    int exponent = int(s.words[0] >> 30 | s.words[1] >> 30 << 2 | s.words[2] >> 30 << 4) + LEAST_EXPONENT;
    float scale = unit * uintBitsToFloat(uint(127 - 9 + exponent) << 23);
    mat3 v;
    for (uint c = 0; c < 3; ++c) {
        int word = int(s.words[c]);
        v[c] = scale * vec3(bitfieldExtract(word, 0, 10), bitfieldExtract(word, 10, 10), bitfieldExtract(word, 20, 10));
    }
    return v;
}
#endif
