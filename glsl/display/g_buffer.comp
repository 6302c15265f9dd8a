#version 460
#extension GL_EXT_nonuniform_qualifier : require
#include "lib/prelude.glsl"
#include "lib/material.glsl"

// One thread per pixel: the surface its triangle shows there, textures filtered over the pixel.
// reads visible_triangles (index + 1), triangles, positions, normals, tangents, attributes, materials, textures
// writes g_position (xyz m, w barycentric of vertex 1), g_normal (xyz unit, towards the eye; w GGX alpha),
//        g_albedo (rgb, w specular at grazing), g_specular (rgb at normal incidence, w barycentric of vertex 2),
//        g_emission (rgb W m^-2 sr^-1, w 1 where the surface reflects)   shared none
layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0) uniform usampler2D visible_triangles;
layout(set = 0, binding = 1, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Normals { vec3 normals[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Tangents { vec4 tangents[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Attributes { VertexAttributes attributes[]; };
layout(set = 0, binding = 6, scalar) readonly buffer TriangleMaterials { uint triangle_materials[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Materials { Material materials[]; };
layout(set = 0, binding = 8, rgba32f) writeonly uniform image2D g_position;
layout(set = 0, binding = 9, rgba32f) writeonly uniform image2D g_normal;
layout(set = 0, binding = 10, rgba32f) writeonly uniform image2D g_albedo;
layout(set = 0, binding = 11, rgba32f) writeonly uniform image2D g_specular;
layout(set = 0, binding = 12, rgba32f) writeonly uniform image2D g_emission;
layout(set = 1, binding = 0) uniform sampler2D textures[];
// eye: position and 1, or the direction to an orthographic eye and 0; footprint: side of what is sampled, pixels.
layout(push_constant, scalar) uniform Params { mat4 clip_from_world; vec4 eye; float footprint; } params;

const uint MAX_TAPS = 16;

// Texture coordinates where the footprint ends to the right and below.
VertexAttributes right_of, below;

// The mean over the footprint, a parallelogram on the texture: along its longer side in taps as long as it is wide, each of
// the mip level of that width. One tap for all of it would smear what is seen at a grazing angle.
vec4 sample_texture(TextureSlot slot, vec2 uv)
{
    vec2 to_right = slot_uv(slot, right_of) - uv, down = slot_uv(slot, below) - uv;
    vec2 size = vec2(textureSize(textures[nonuniformEXT(slot.texture)], 0));
    vec2 u = to_right * size, v = down * size;
    bool is_right = dot(u, u) >= dot(v, v);
    float longer = sqrt(is_right ? dot(u, u) : dot(v, v));
    float width = max(abs(u.x * v.y - u.y * v.x) / max(longer, 1e-20), 1.0);
    uint taps = clamp(uint(ceil(min(longer / width, float(MAX_TAPS)))), 1u, MAX_TAPS);
    float level = log2(max(width, longer / float(taps)));
    vec2 tap = (is_right ? to_right : down) / float(taps);
    vec4 sum = vec4(0.0);
    for (uint k = 0; k < taps; ++k)
        sum += textureLod(textures[nonuniformEXT(slot.texture)], uv + (float(k) + 0.5 - 0.5 * float(taps)) * tap, level);
    return sum / float(taps);
}

// Perspective-correct barycentrics at a place of the picture, by Cramer's rule on (x, y, w) of the corners.
vec3 barycentrics_at(vec3 a, vec3 b, vec3 c, vec2 ndc)
{
    vec3 p = vec3(ndc, 1.0);
    vec3 w = vec3(dot(p, cross(b, c)), dot(p, cross(c, a)), dot(p, cross(a, b)));
    float sum = w.x + w.y + w.z;
    return sum != 0.0 ? w / sum : vec3(1.0, 0.0, 0.0);
}

vec3 clip_xyw(vec3 position) { return (params.clip_from_world * vec4(position, 1.0)).xyw; }

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = textureSize(visible_triangles, 0);
    if (any(greaterThanEqual(pixel, size))) return;
    uint seen = texelFetch(visible_triangles, pixel, 0).x;
    if (seen == 0) return;

    uint triangle = seen - 1;
    uvec3 v = triangles[triangle];
    vec3 p0 = positions[v.x], p1 = positions[v.y], p2 = positions[v.z];
    vec3 a = clip_xyw(p0), b = clip_xyw(p1), c = clip_xyw(p2);
    vec2 step_ndc = 2.0 / vec2(size);
    vec2 ndc = (vec2(pixel) + 0.5) * step_ndc - 1.0;
    vec3 w = clamp(barycentrics_at(a, b, c, ndc), 0.0, 1.0);
    w /= w.x + w.y + w.z;

    VertexAttributes f = attributes[v.x], g = attributes[v.y], h = attributes[v.z];
    VertexAttributes at = interpolated(f, g, h, w);
    right_of = interpolated(f, g, h, barycentrics_at(a, b, c, ndc + vec2(params.footprint * step_ndc.x, 0.0)));
    below = interpolated(f, g, h, barycentrics_at(a, b, c, ndc + vec2(0.0, params.footprint * step_ndc.y)));

    vec3 position = w.x * p0 + w.y * p1 + w.z * p2;
    vec3 geometric = cross(p1 - p0, p2 - p0);
    bool is_back = dot(geometric, params.eye.xyz - params.eye.w * position) < 0.0;
    vec3 normal = normalize(w.x * normals[v.x] + w.y * normals[v.y] + w.z * normals[v.z]);
    vec4 tangent = w.x * tangents[v.x] + w.y * tangents[v.y] + w.z * tangents[v.z];
    tangent = vec4(normalize(tangent.xyz), tangent.w < 0.0 ? -1.0 : 1.0);

    Material m = materials[triangle_materials[triangle]];
    Surface s = surface_of(m, at, normal, tangent, is_back);
    // An unlit surface shows its base colour as it is.
    if ((m.flags & UNLIT) != 0) s.emission = base_color_of(m, at).rgb;

    imageStore(g_position, pixel, vec4(position, w.y));
    imageStore(g_normal, pixel, vec4(s.normal, s.alpha));
    imageStore(g_albedo, pixel, vec4(s.reflects ? s.albedo : vec3(0.0), s.reflects ? s.f90 : 0.0));
    imageStore(g_specular, pixel, vec4(s.reflects ? s.f0 : vec3(0.0), w.z));
    imageStore(g_emission, pixel, vec4(s.emission, s.reflects ? 1.0 : 0.0));
}
