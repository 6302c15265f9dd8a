#ifndef TABLE
#define TABLE
// Entries of a table of colours: three f32, or three f16 in two words.
// The kernel declares the specialisation constant WORDS and unsized arrays of words for the tables it binds.

vec3 entry_of_words(uint a, uint b, uint c)
{
    if (WORDS == 2) return vec3(unpackHalf2x16(a), unpackHalf2x16(b).x);
    return uintBitsToFloat(uvec3(a, b, c));
}

uvec3 words_of_entry(vec3 value)
{
    // The largest f16, so that what overflows stays finite and is seen in the residual.
    if (WORDS == 2) {
        value = clamp(value, vec3(-65504.0), vec3(65504.0));
        return uvec3(packHalf2x16(value.xy), packHalf2x16(vec2(value.z, 0.0)), 0u);
    }
    return floatBitsToUint(value);
}

#define LOAD_ENTRY(words, index) entry_of_words(words[(index) * WORDS], words[(index) * WORDS + 1], WORDS == 2 ? 0u : words[(index) * WORDS + 2])
#define STORE_ENTRY(words, index, value) { uvec3 stored = words_of_entry(value); words[(index) * WORDS] = stored.x; words[(index) * WORDS + 1] = stored.y; if (WORDS == 3) words[(index) * WORDS + 2] = stored.z; }
#endif
