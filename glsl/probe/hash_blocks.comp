#version 460
#include "lib/prelude.glsl"

// One thread per block of words: a hash of what another pass left there.
// reads words[word_count]   writes hashes[first_hash ..]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Words { uint words[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Hashes { uint hashes[]; };
layout(push_constant, scalar) uniform Params {
    uint word_count;
    uint words_per_block;
    uint block_count;
    uint first_hash;
} params;

void main()
{
    uint block = linear_index();
    if (block >= params.block_count) return;

    uint hash = 2166136261u;
    uint end = min((block + 1) * params.words_per_block, params.word_count);
    for (uint word = block * params.words_per_block; word < end; ++word) {
        hash = (hash ^ words[word]) * 16777619u;
        hash ^= hash >> 15;
    }
    hashes[params.first_hash + block] = hash;
}
