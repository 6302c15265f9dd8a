#ifndef TABLE
#define TABLE
// Entries of a table of colours, bin by bin and node by node: three f16 in 64 bits, or three f32 in twice that. Long words
// make few loads, which is what these passes wait for; what one bin's transfers read is a stretch that caches hold.
// The kernel declares the specialisation constant WORDS (1 or 2 a entry) and arrays of uint64_t for the tables it binds.

// Bins that one thread works through, where its neighbours work through the same bins of the next nodes: few enough that a
// memory's prefetching follows all their stretches of the table.
const uint BINS_A_THREAD = 8;

// Where a table of `node_count` nodes has a bin of a node, counted from the table's first.
uint entry_of(uint node, uint bin, uint node_count) { return bin * node_count + node; }

vec3 entry_of_words(uint64_t first, uint64_t second)
{
    uvec2 a = unpackUint2x32(first);
    if (WORDS == 1) return vec3(unpackHalf2x16(a.x), unpackHalf2x16(a.y).x);
    return uintBitsToFloat(uvec3(a, unpackUint2x32(second).x));
}

uint64_t first_word(vec3 value)
{
    // At most the largest f16, so that what overflows stays finite and is seen in the residual.
    if (WORDS == 1) {
        value = clamp(value, vec3(-65504.0), vec3(65504.0));
        return packUint2x32(uvec2(packHalf2x16(value.xy), packHalf2x16(vec2(value.z, 0.0))));
    }
    return packUint2x32(floatBitsToUint(value.xy));
}

uint64_t second_word(vec3 value) { return packUint2x32(uvec2(floatBitsToUint(value.z), 0u)); }

#define LOAD_ENTRY(words, index) entry_of_words(words[(index) * WORDS], words[(index) * WORDS + (WORDS - 1)])
#define STORE_ENTRY(words, index, value) { words[(index) * WORDS] = first_word(value); if (WORDS == 2) words[(index) * WORDS + (WORDS - 1)] = second_word(value); }
#endif
