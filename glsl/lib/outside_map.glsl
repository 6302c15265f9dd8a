#ifndef LIB_OUTSIDE_MAP
#define LIB_OUTSIDE_MAP
// Maps of an object from outside: orthographic, along directions over half a sphere, three faces of a cube of `directions`
// x `directions` each, walked to and fro. A way between two points outside the object's hull is blocked where some depth
// of the object lies between them.                                                               [Ritschel2008 3.1]
#include "lib/cube_map.glsl"
#include "lib/hemisphere.glsl"

const uint OUTSIDE_FREE = 0xffffu;      // no surface along a pixel
const float OUTSIDE_REACH = 1.01;       // radii that a map reaches before and behind the object's middle

// Of a place in the walk, or the place of a cell: rows to and fro.
uint outside_walk(uint place, uint directions)
{
    uint row = place / directions, column = place % directions;
    return row * directions + ((row & 1) == 0 ? column : directions - 1 - column);
}

// Across the map, and its direction in the third column.
mat3 outside_frame(uint place, uint directions)
{
    uint cell = outside_walk(place, directions), face = cell / (directions * directions);
    uint within = cell % (directions * directions);
    vec2 at = (vec2(within % directions, within / directions) + 0.5) * (2.0 / float(directions)) - 1.0;
    return basis_of(normalize(cube_direction(2 * face, at)));
}

// Of a depth in radii about the object's middle; 0 to 65534 is within the map's reach.
float outside_code(float depth) { return clamp((depth / OUTSIDE_REACH * 0.5 + 0.5) * 65534.0, 0.0, 65534.0); }
#endif
