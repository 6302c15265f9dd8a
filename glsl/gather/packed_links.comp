#version 460
#include "lib/prelude.glsl"
#include "lib/link.glsl"
#include "lib/shared_exponent.glsl"

// As gather/links, for packed links and radiosities.                                              [Schmitz2008 3.3, Eq. 3]
// reads link_offsets[element_count + 1], packed_links of one window, sent[sender_count] (radiosity, W/m2, as of encode_32)
// writes irradiance[first_element .. + receiver_count] (W/m2)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer LinkOffsets { uint link_offsets[]; };
layout(set = 0, binding = 1, scalar) readonly buffer PackedLinks { uint packed_links[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Sent { uint sent[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Irradiance { vec3 irradiance[]; };
layout(push_constant, scalar) uniform Params {
    uint first_element;
    uint receiver_count;
    uint first_link;        // of the window, among all links
} params;

vec3 carried(uint k)
{
    uint link = packed_links[k];
    return float(link & (PACKED_UNITS - 1)) * decode_32(sent[link >> PACKED_WEIGHT_BITS]);
}

void main()
{
    uint i = linear_index();
    if (i >= params.receiver_count) return;

    uint receiver = params.first_element + i;
    uint k = link_offsets[receiver] - params.first_link, last = link_offsets[receiver + 1] - params.first_link;
    vec3 sum = vec3(0.0);
    for (; k + 4 <= last; k += 4) sum += carried(k) + carried(k + 1) + carried(k + 2) + carried(k + 3);
    for (; k < last; ++k) sum += carried(k);
    irradiance[receiver] = sum / float(PACKED_UNITS);
}
