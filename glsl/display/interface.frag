#version 460
#include "lib/prelude.glsl"

// One fragment of the user interface: its texture tinted, within its clip rectangle. Blending is done on encoded
// values, as the interface was designed for.
// reads clips, the interface's texture   writes the frame   shared none
layout(set = 0, binding = 2, scalar) readonly buffer Clips { vec4 clips[]; };  // left, top, right, bottom: pixels
layout(set = 0, binding = 3) uniform sampler2D glyphs;

layout(location = 0) in vec2 in_uv;
layout(location = 1) in vec4 in_color;
layout(location = 2) flat in uint in_clip;
layout(location = 0) out vec4 out_color;

void main()
{
    vec4 clip = clips[in_clip];
    if (any(lessThan(gl_FragCoord.xy, clip.xy)) || any(greaterThan(gl_FragCoord.xy, clip.zw))) discard;
    out_color = in_color * textureLod(glyphs, in_uv, 0.0);
}
