#ifndef LIB_CUBE_MAP
#define LIB_CUBE_MAP
// Directions as pixels of a cube map: six faces, +x -x +y -y +z -z, of `resolution` x `resolution` pixels each.
#include "lib/shadow.glsl"

// The direction through a place of a face, -1..1 each way; not unit.
vec3 cube_direction(uint face, vec2 at)
{
    float s = (face & 1u) == 0u ? 1.0 : -1.0;
    return face < 2u ? vec3(s, at) : face < 4u ? vec3(at.x, s, at.y) : vec3(at, s);
}

// Through the middle of a pixel; unit.
vec3 cube_pixel_direction(uint face, uvec2 at, uint resolution)
{
    return normalize(cube_direction(face, (vec2(at) + 0.5) * (2.0 / float(resolution)) - 1.0));
}

// Where a direction goes through its face, in pixels from the face's corner.
vec2 cube_place(vec3 d, uint face, uint resolution)
{
    float longest = max(abs(d.x), max(abs(d.y), abs(d.z)));
    vec2 at = (face < 2u ? d.yz : face < 4u ? d.xz : d.xy) / longest;
    return (at * 0.5 + 0.5) * float(resolution);
}

uint cube_pixel_index(uint face, uvec2 at, uint resolution) { return (face * resolution + at.y) * resolution + at.x; }
#endif
