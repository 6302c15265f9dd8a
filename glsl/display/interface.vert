#version 460
#include "lib/prelude.glsl"

// One corner of a triangle of the user interface.
// reads indices, corners   writes nothing but the frame   shared none
struct InterfaceCorner {
    vec2 position;  // pixels from the top left corner
    vec2 uv;
    uint color;     // sRGB bytes, premultiplied by alpha
    uint clip;      // index of its clip rectangle
};
layout(set = 0, binding = 0, scalar) readonly buffer Corners { InterfaceCorner corners[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Indices { uint indices[]; };
layout(push_constant, scalar) uniform Params { vec2 frame_size; } params;

layout(location = 0) out vec2 out_uv;
layout(location = 1) out vec4 out_color;
layout(location = 2) flat out uint out_clip;

void main()
{
    InterfaceCorner corner = corners[indices[gl_VertexIndex]];
    gl_Position = vec4(corner.position / params.frame_size * 2.0 - 1.0, 0.0, 1.0);
    out_uv = corner.uv;
    out_color = unpackUnorm4x8(corner.color);
    out_clip = corner.clip;
}
