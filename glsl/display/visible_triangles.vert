#version 460
#include "lib/prelude.glsl"
#include "lib/scene.glsl"

// One vertex per triangle corner, seen by the camera.
// reads triangles, positions, attributes   writes (fragment stage)   shared none
layout(set = 0, binding = 0, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Attributes { VertexAttributes attributes[]; };
layout(push_constant, scalar) uniform Params { mat4 clip_from_world; } params;

layout(location = 0) out vec2 out_uv0;
layout(location = 1) out vec2 out_uv1;
layout(location = 2) out vec4 out_color;
layout(location = 3) flat out uint out_triangle;

void main()
{
    uint triangle = gl_VertexIndex / 3;
    uint vertex = triangles[triangle][gl_VertexIndex % 3];
    gl_Position = params.clip_from_world * vec4(positions[vertex], 1.0);
    out_uv0 = attributes[vertex].uv0;
    out_uv1 = attributes[vertex].uv1;
    out_color = attributes[vertex].color;
    out_triangle = triangle;
}
