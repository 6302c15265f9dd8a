#ifndef SURFACE_MAPS_PIXEL_RAY
#define SURFACE_MAPS_PIXEL_RAY
// Where the ray of a map's pixel goes.                                                           [Ritschel2008 3.2]
#include "lib/cube_map.glsl"

// Through the middle of the pixel where that lies above the map's plane. A point hardly above it is filtered over pixels
// with their middles below, up to a pixel's width off: those look between the plane and the highest such place. False for
// all others: no point is looked up in them.
// Differs from [Ritschel2008]: there every pixel below the plane is open, and answers by whatever depth stands there.
bool map_pixel_ray(uint pixel, uint resolution, vec3 normal, out vec3 direction)
{
    uint face = pixel / (resolution * resolution), within = pixel % (resolution * resolution);
    float width = 2.0 / float(resolution);
    vec2 at = (vec2(within % resolution, within / resolution) + 0.5) * width - 1.0;
    vec3 middle = cube_direction(face, at);
    direction = normalize(middle);
    float height = dot(middle, normal);
    if (height > 0.0) return true;
    vec2 slope = width * (face < 2u ? normal.yz : face < 4u ? normal.xz : normal.xy);
    float rise = abs(slope.x) + abs(slope.y);
    if (height + rise <= 0.0) return false;
    direction = normalize(cube_direction(face, at + 0.5 * (1.0 - height / rise) * width * sign(slope)));
    return true;
}
#endif
