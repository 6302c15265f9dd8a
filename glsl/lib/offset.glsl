#ifndef LIB_OFFSET
#define LIB_OFFSET
// Where rays leave a surface, so that they do not hit it again by rounding.
//
// Differs from [Waechter2019]: they move by 256 units in the last place of each coordinate, and by 1.5e-5 m near
// the origin. A point interpolated between vertices is off by a few units of the *vertices'* last places, so the
// largest of their coordinates is the scale: scenes of a millimetre and of a kilometre alike.

// Metres to move along the normal from a point of the triangle a, b, c.
float offset_length(vec3 a, vec3 b, vec3 c)
{
    vec3 largest = max(abs(a), max(abs(b), abs(c)));
    return max(largest.x, max(largest.y, largest.z)) * (1.0 / 524288.0);
}
#endif
