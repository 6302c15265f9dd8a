#version 460
#include "lib/prelude.glsl"
#include "lib/link.glsl"

// One thread per receiver: irradiance by its links.                                               [Schmitz2008 3.3, Eq. 3]
// reads link_offsets[element_count + 1], links of one window, radiosity[sender_count] (W/m2)
// writes irradiance[first_element .. + receiver_count] (W/m2)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer LinkOffsets { uint link_offsets[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Links { Link links[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Radiosity { vec3 radiosity[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Irradiance { vec3 irradiance[]; };
layout(push_constant, scalar) uniform Params {
    uint first_element;
    uint receiver_count;
    uint first_link;        // of the window, among all links
} params;

void main()
{
    uint i = linear_index();
    if (i >= params.receiver_count) return;

    uint receiver = params.first_element + i;
    uint last = link_offsets[receiver + 1] - params.first_link;
    vec3 sum = vec3(0.0);
    for (uint k = link_offsets[receiver] - params.first_link; k < last; ++k)
        sum += links[k].weight * radiosity[links[k].sender];
    irradiance[receiver] = sum;
}
