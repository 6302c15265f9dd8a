#version 460
#include "lib/prelude.glsl"
#include "lib/cluster_basis.glsl"

// One thread per point, for tests of the basis: all functions there.
// reads points[point_count]   writes values[point_count * MOST_FUNCTIONS]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Points { vec2 points[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Values { float values[]; };
layout(push_constant, scalar) uniform Params { uint point_count; } params;

void main()
{
    uint i = linear_index();
    if (i >= params.point_count) return;
    for (uint k = 0; k < MOST_FUNCTIONS; ++k) values[i * MOST_FUNCTIONS + k] = basis(k, points[i]);
}
