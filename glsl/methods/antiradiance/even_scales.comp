#version 460
#include "lib/prelude.glsl"

// One thread per side of a leaf: the scale of what its links bring, by which an even light is right.
// reads at_leaves, excess [side_count] (of an even light, in the same units; how much more links bring)   writes scales[side_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer AtLeaves { uint at_leaves[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Excess { uint excess[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Scales { float scales[]; };
layout(push_constant, scalar) uniform Params { uint side_count; } params;

// Where little arrives at all the two may be far apart.
const float LARGEST = 2.0;

void main()
{
    uint i = linear_index();
    if (i >= params.side_count) return;
    uint at_leaf = at_leaves[i], by_links = at_leaf + excess[i];
    scales[i] = by_links > 0 ? clamp(float(at_leaf) / float(by_links), 1.0 / LARGEST, LARGEST) : 1.0;
}
