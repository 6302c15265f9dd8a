#version 460
#include "lib/prelude.glsl"
#include "lib/shared_exponent.glsl"

// One thread per sender: its radiosity in half a word, for gather/packed_links.
// reads radiosity[sender_count] (W/m2)   writes sent[sender_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Radiosity { vec3 radiosity[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Sent { uint sent[]; };
layout(push_constant, scalar) uniform Params { uint sender_count; } params;

void main()
{
    uint sender = linear_index();
    if (sender >= params.sender_count) return;
    sent[sender] = encode_32(radiosity[sender]);
}
