#ifndef LIB_ELEMENT_RAYS
#define LIB_ELEMENT_RAYS
// The rays of an element: a square grid mapped to the hemisphere, cosine-weighted.                [Schmitz2008 3.2]
// Numbered in blocks of 4 x 4, so that neighbouring threads follow neighbouring rays.
#include "lib/hemisphere.glsl"

// Two hashes in 0..1 of an element's index.                                                       [Jarzynski2020 pcg2d]
vec2 element_shift(uint element)
{
    uvec2 v = uvec2(element, element ^ 0x9e3779b9u) * 1664525u + 1013904223u;
    v.x += v.y * 1664525u;
    v.y += v.x * 1664525u;
    v ^= v >> 16;
    v.x += v.y * 1664525u;
    v.y += v.x * 1664525u;
    v ^= v >> 16;
    return vec2(v >> 8) / 16777216.0;
}

// Direction about +z of one of side^2 rays; `shift` turns the grid over in the square.            [Cranley1976]
vec3 element_ray(uint ray, uint side, vec2 shift)
{
    uint block = ray / 16, blocks = side / 4;
    uvec2 cell = uvec2(block % blocks, block / blocks) * 4 + uvec2(ray % 4, ray / 4 % 4);
    return cosine_hemisphere(fract((vec2(cell) + 0.5) / float(side) + shift));
}
#endif
