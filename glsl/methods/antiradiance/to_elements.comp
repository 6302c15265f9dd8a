#version 460
#include "lib/prelude.glsl"
#include "lib/hierarchy.glsl"

// One thread per vertex: the irradiance of its sides from the leaves that it takes light from, for the display.
// reads share_offsets[vertex_count + 1], shares, back_elements[vertex_count], leaf_irradiance[2 leaf_count] (W/m2)
// writes irradiance[element_count] (W/m2)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer ShareOffsets { uint share_offsets[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Shares { LeafShare shares[]; };
layout(set = 0, binding = 2, scalar) readonly buffer BackElements { uint back_elements[]; };
layout(set = 0, binding = 3, scalar) readonly buffer LeafIrradiance { vec3 leaf_irradiance[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer Irradiance { vec3 irradiance[]; };
layout(push_constant, scalar) uniform Params { uint vertex_count; } params;

void main()
{
    uint vertex = linear_index();
    if (vertex >= params.vertex_count) return;
    vec3 front = vec3(0.0), back = vec3(0.0);
    for (uint k = share_offsets[vertex]; k < share_offsets[vertex + 1]; ++k) {
        LeafShare own = shares[k];
        // Deep shadow may come out a little below zero: two sums of one size were subtracted.
        front += own.share * max(leaf_irradiance[2 * own.leaf], vec3(0.0));
        back += own.share * max(leaf_irradiance[2 * own.leaf + 1], vec3(0.0));
    }
    irradiance[vertex] = front;
    if (back_elements[vertex] != NONE) irradiance[back_elements[vertex]] = back;
}
