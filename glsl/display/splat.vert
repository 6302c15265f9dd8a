#version 460
#include "lib/prelude.glsl"
#include "lib/splat.glsl"

// One corner of a splat's two triangles, in the plane of its patch.                       [Dachsbacher2007 4.3, second pass]
// reads splats[splat_count]   writes (fragment stage)   shared none
layout(set = 0, binding = 0, scalar) readonly buffer Splats { Splat splats[]; };
// eye: position and 1, or the direction to an orthographic eye and 0.
layout(push_constant, scalar) uniform Params { mat4 clip_from_world; vec4 eye; } params;

layout(location = 0) flat out uint out_splat;
layout(location = 1) flat out uint out_side;

void main()
{
    const vec2 corners[SPLAT_CORNERS] = vec2[](vec2(-1.0, -1.0), vec2(1.0, -1.0), vec2(1.0, 1.0), vec2(-1.0, -1.0), vec2(1.0, 1.0), vec2(-1.0, 1.0));
    Splat s = splats[gl_InstanceIndex];
    vec2 at = SPLAT_REACH * corners[gl_VertexIndex];
    gl_Position = params.clip_from_world * vec4(s.center + at.x * s.half_u + at.y * s.half_v, 1.0);
    vec3 to_eye = params.eye.w == 0.0 ? params.eye.xyz : params.eye.xyz - s.center;
    out_splat = gl_InstanceIndex;
    out_side = dot(cross(s.half_u, s.half_v), to_eye) < 0.0 ? 1 : 0;
}
