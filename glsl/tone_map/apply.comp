#version 460
#include "lib/prelude.glsl"
#include "lib/film.glsl"
#include "lib/tone_curve.glsl"

// One thread per pixel of the film: what a display shows of it, at its place in the frame. Pixels that are NaN or
// infinite are magenta.                                                           [Reinhard2002, Eq. 2 and 4], [Hable2010]
// reads direct, indirect [pixel_count], average[2]   writes frame   shared none
layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0, scalar) readonly buffer Direct { vec3 direct[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Indirect { vec3 indirect[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Average { float average[]; };     // floor, log average
layout(set = 0, binding = 3, rgba8) uniform writeonly image2D frame;
layout(push_constant, scalar) uniform Params {
    uvec2 film_size;
    uvec2 corner;       // of the film's picture in the frame
    uint light_parts;
    uint operator;
    float exposure;     // factor
    float key;          // display luminance of the average
    float white;
} params;

vec3 encoded(vec3 linear) { return vec3(srgb_encoded(linear.x), srgb_encoded(linear.y), srgb_encoded(linear.z)); }

vec3 curve(vec3 color)
{
    if (params.operator == TONE_REINHARD) {
        float scaled = luminance_of(color);
        return scaled > 0.0 ? color * ((1.0 + scaled / (params.white * params.white)) / (1.0 + scaled)) : color;
    }
    if (params.operator == TONE_FILMIC) {
        vec3 x = 2.0 * max(color, vec3(0.0));
        return vec3(hable(x.x), hable(x.y), hable(x.z)) / hable(11.2);
    }
    return color;
}

void main()
{
    uvec2 at = gl_GlobalInvocationID.xy;
    uvec2 place = params.corner + at;
    if (any(greaterThanEqual(at, params.film_size)) || any(greaterThanEqual(place, imageSize(frame)))) return;
    uint pixel = at.y * params.film_size.x + at.x;
    vec3 light = shown_light(direct[pixel], indirect[pixel], params.light_parts);
    vec3 shown = vec3(1.0, 0.0, 1.0);
    if (is_finite(light)) {
        bool keyed = params.operator == TONE_REINHARD || params.operator == TONE_FILMIC;
        float scale = params.exposure * (keyed && average[1] > 0.0 ? params.key / average[1] : 1.0);
        shown = encoded(clamp(curve(min(light * scale, vec3(1e15))), 0.0, 1.0));
    }
    imageStore(frame, ivec2(place), vec4(shown, 1.0));
}
