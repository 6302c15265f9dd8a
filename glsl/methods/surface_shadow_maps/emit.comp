#version 460
#include "lib/prelude.glsl"
#include "lib/hemisphere.glsl"

// One thread per texel: radiosity of what it emits.
// reads emission (W m^-2 sr^-1)   writes emitted (W/m2) [texel_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Emission { vec3 emission[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Emitted { vec3 emitted[]; };
layout(push_constant, scalar) uniform Params { uint texel_count; } params;

void main()
{
    uint texel = linear_index();
    if (texel < params.texel_count) emitted[texel] = PI * emission[texel];
}
