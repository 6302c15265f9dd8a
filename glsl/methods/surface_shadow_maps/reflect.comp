#version 460
#include "lib/prelude.glsl"

// One thread per texel: what arrived leaves again evenly, and adds to what left in all bounces so far.
//                                                                                               [Ritschel2008 4.1]
// reads irradiance (W/m2), even_albedo [texel_count]   updates reflected, reflected_sum, indirect [texel_count] (W/m2)
// shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Irradiance { vec3 irradiance[]; };
layout(set = 0, binding = 1, scalar) readonly buffer EvenAlbedo { vec3 even_albedo[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Reflected { vec3 reflected[]; };
layout(set = 0, binding = 3, scalar) buffer ReflectedSum { vec3 reflected_sum[]; };
layout(set = 0, binding = 4, scalar) buffer IndirectIrradiance { vec3 indirect[]; };
layout(push_constant, scalar) uniform Params { uint texel_count; uint is_indirect; } params;

void main()
{
    uint texel = linear_index();
    if (texel >= params.texel_count) return;
    vec3 arrived = irradiance[texel];
    reflected[texel] = even_albedo[texel] * arrived;
    reflected_sum[texel] += even_albedo[texel] * arrived;
    if (params.is_indirect != 0) indirect[texel] += arrived;
}
