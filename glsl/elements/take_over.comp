#version 460
#include "lib/prelude.glsl"

// One thread per pair: the first of it takes over the second's value. No element is the first of one pair and the second
// of another, so that it works in place.
// reads pairs[pair_count] (hidden element, element in the open)   updates values[element_count] (W/m2)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Pairs { uvec2 pairs[]; };
layout(set = 0, binding = 1, scalar) buffer Values { vec3 values[]; };
layout(push_constant, scalar) uniform Params { uint pair_count; } params;

void main()
{
    uint i = linear_index();
    if (i >= params.pair_count) return;
    values[pairs[i].x] = values[pairs[i].y];
}
