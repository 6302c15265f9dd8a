#ifndef DISPLAY_SEEN
#define DISPLAY_SEEN
// What a pixel sees, out of the G-buffer: what the display stages start from, one thread a pixel. Binds 3
// and 24 to 30 of set 0; where rays are cast as well, 3 is bound by trace/holes.
#include "lib/brdf.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 24) uniform usampler2D visible_triangles;
layout(set = 0, binding = 25) uniform sampler2D g_position;
layout(set = 0, binding = 26) uniform sampler2D g_normal;
layout(set = 0, binding = 27) uniform sampler2D g_albedo;
layout(set = 0, binding = 28) uniform sampler2D g_specular;
layout(set = 0, binding = 29) uniform sampler2D g_emission;
#ifndef TRACE_HOLES
layout(set = 0, binding = 3, scalar) readonly buffer Triangles { uvec3 triangles[]; };
#endif
layout(set = 0, binding = 30, scalar) readonly buffer Positions { vec3 positions[]; };

struct Seen {
    uint triangle;
    uvec3 vertices;     // its corners
    vec3 weights;       // of the corners
    bool is_back;
    vec3 position;      // metres
    vec3 geometric;     // unit, of the triangle, towards the eye
    vec3 to_eye;        // unit
    Surface surface;
};

// The thread's pixel and its place in the film, row by row; false outside of the picture.
bool is_in_picture(out ivec2 pixel, out uint index)
{
    pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = textureSize(visible_triangles, 0);
    index = uint(pixel.y) * uint(size.x) + uint(pixel.x);
    return all(lessThan(pixel, size));
}

// False where nothing is seen. `eye`: its position and 1, or the direction to an orthographic one and 0.
bool is_seen(ivec2 pixel, vec4 eye, out Seen seen)
{
    uint triangle = texelFetch(visible_triangles, pixel, 0).x;
    if (triangle == 0) return false;

    vec4 position = texelFetch(g_position, pixel, 0), normal = texelFetch(g_normal, pixel, 0);
    vec4 diffuse = texelFetch(g_albedo, pixel, 0), specular = texelFetch(g_specular, pixel, 0);
    vec4 emitted = texelFetch(g_emission, pixel, 0);
    seen.triangle = triangle - 1;
    seen.vertices = triangles[seen.triangle];
    seen.weights = vec3(1.0 - position.w - specular.w, position.w, specular.w);
    seen.position = position.xyz;
    seen.to_eye = eye.w == 0.0 ? eye.xyz : normalize(eye.xyz - position.xyz);
    vec3 a = positions[seen.vertices.x];
    vec3 across = normalize(cross(positions[seen.vertices.y] - a, positions[seen.vertices.z] - a));
    seen.is_back = dot(across, seen.to_eye) < 0.0;
    seen.geometric = seen.is_back ? -across : across;
    seen.surface = Surface(diffuse.rgb, specular.rgb, diffuse.w, normal.w, emitted.rgb, normal.xyz, emitted.w > 0.5);
    return true;
}
#endif
