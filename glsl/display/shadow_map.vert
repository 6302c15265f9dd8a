#version 460
#include "lib/prelude.glsl"
#include "lib/scene.glsl"
#include "lib/shadow.glsl"

// One vertex per triangle corner, seen from one view of a light.
// reads triangles, positions, attributes, shadow_views   writes nothing but the depth image   shared none
layout(set = 0, binding = 0, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Attributes { VertexAttributes attributes[]; };
layout(set = 0, binding = 3, scalar) readonly buffer ShadowViews { ShadowView shadow_views[]; };
layout(push_constant, scalar) uniform Params { uint view; } params;

layout(location = 0) out vec2 out_uv0;
layout(location = 1) out vec2 out_uv1;
layout(location = 2) out vec4 out_color;
layout(location = 3) flat out uint out_triangle;

void main()
{
    uint triangle = gl_VertexIndex / 3;
    uint vertex = triangles[triangle][gl_VertexIndex % 3];
    gl_Position = shadow_views[params.view].clip_from_world * vec4(positions[vertex], 1.0);
    out_uv0 = attributes[vertex].uv0;
    out_uv1 = attributes[vertex].uv1;
    out_color = attributes[vertex].color;
    out_triangle = triangle;
}
