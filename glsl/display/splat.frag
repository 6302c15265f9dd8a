#version 460
#include "lib/prelude.glsl"
#include "lib/splat.glsl"

// One fragment: a patch's light where the pixel sees its surface, by a weight that falls to nothing at the patches beside it.
// reads visible_triangles, g_position, triangle_surfaces[triangle_count], splats, splat_light[4 * splat_count] (W/m2)   adds to the two accumulators (weight in w)   shared none
// Differs from [Dachsbacher2007]: rectangles in place of fans, and a weight that is bilinear on a regular grid of patches.
layout(set = 0, binding = 0, scalar) readonly buffer Splats { Splat splats[]; };
layout(set = 0, binding = 1) uniform usampler2D visible_triangles;
layout(set = 0, binding = 2) uniform sampler2D g_position;
layout(set = 0, binding = 3, scalar) readonly buffer TriangleSurfaces { uint triangle_surfaces[]; };
layout(set = 0, binding = 4, scalar) readonly buffer SplatLight { vec3 splat_light[]; };

layout(location = 0) flat in uint in_splat;
layout(location = 1) flat in uint in_side;
layout(location = 0) out vec4 out_direct;
layout(location = 1) out vec4 out_indirect;

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    uint seen = texelFetch(visible_triangles, pixel, 0).x;
    Splat s = splats[in_splat];
    if (seen == 0 || triangle_surfaces[seen - 1] != s.surface) discard;
    vec3 offset = texelFetch(g_position, pixel, 0).xyz - s.center;
    vec2 lengths = max(vec2(dot(s.half_u, s.half_u), dot(s.half_v, s.half_v)), vec2(1e-30));
    vec2 at = abs(vec2(dot(offset, s.half_u), dot(offset, s.half_v))) / (SPLAT_REACH * lengths);
    float weight = max(1.0 - at.x, 0.0) * max(1.0 - at.y, 0.0);
    if (!(weight > 0.0)) discard;
    out_direct = vec4(weight * splat_light[4 * in_splat + in_side], weight);
    out_indirect = vec4(weight * splat_light[4 * in_splat + 2 + in_side], weight);
}
