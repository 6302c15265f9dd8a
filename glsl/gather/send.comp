#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/shared_exponent.glsl"

// One thread per sender: its radiosity in one word, for gather/links.
// reads radiosity[sender_count] (W/m2)   writes sent[sender_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Radiosity { vec3 radiosity[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Sent { uint64_t sent[]; };
layout(push_constant, scalar) uniform Params { uint sender_count; } params;

void main()
{
    uint sender = linear_index();
    if (sender >= params.sender_count) return;
    sent[sender] = packUint2x32(encode_64(radiosity[sender]));
}
