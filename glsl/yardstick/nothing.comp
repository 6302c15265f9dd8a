#version 460
#include "lib/prelude.glsl"

// One workgroup that does nothing it could be seen by: what a dispatch costs by itself.
// writes values[1] (never)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) writeonly buffer Values { float values[]; };
layout(push_constant, scalar) uniform Params { uint count; } params;

void main()
{
    if (gl_GlobalInvocationID.x < params.count) values[gl_GlobalInvocationID.x] = 0.0;
}
