#version 460
#include "lib/prelude.glsl"
#include "lib/ray.glsl"

// One thread per word: 32 answers of shadow rays become bits, unset for rays that were not cast. Each row of answers fills
// whole words.
// reads rays, is_free[row_count * row_length] (1 free, 0 blocked)
// writes visible[first_word + row_count * ceil(row_length / 32)]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = 1, scalar) readonly buffer IsFree { uint is_free[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Visible { uint visible[]; };
layout(push_constant, scalar) uniform Params { uint first_word; uint row_count; uint row_length; } params;

void main()
{
    uint i = linear_index();
    uint words = (params.row_length + 31) / 32;
    if (i >= params.row_count * words) return;

    uint row = i / words, first = i % words * 32;
    uint bits = 0;
    for (uint k = first; k < min(first + 32, params.row_length); ++k) {
        uint ray = row * params.row_length + k;
        if (rays[ray].t_max >= 0.0) bits |= is_free[ray] << (k - first);
    }
    visible[params.first_word + i] = bits;
}
