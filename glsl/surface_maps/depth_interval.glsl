#ifndef SURFACE_MAPS_DEPTH_INTERVAL
#define SURFACE_MAPS_DEPTH_INTERVAL
// Which depth codes of a pixel answer every query right, from the first surface to the second: low | high << 16.
//                                                                                                [Ritschel2008 3.2]
// Differs from [Ritschel2008]: the bias stands in the intervals, so that it gives way where surfaces are close; it is small,
// since queries compare along the pixel's own ray.
#include "lib/ray.glsl"

const float FARTHEST = 65534.0;         // beyond every surface
const uint ANY_DEPTH = 0xffff0000u;     // below the surface: never asked

// `bias` is a share of the first surface's distance.
uint depth_interval(Hit first_hit, Hit second_hit, float codes_per_metre, float bias)
{
    if (!is_hit(first_hit)) return 0xffff0000u | uint(FARTHEST);
    float first = first_hit.t * codes_per_metre;
    float off = bias * first;
    float low = ceil(first + off) + 1.0, high = 65535.0;
    if (is_hit(second_hit)) {
        float second = second_hit.t * codes_per_metre;
        high = floor(second - off) - 1.0;
        if (high < low) low = high = floor(0.5 * (first + second));
    }
    low = min(low, high == 65535.0 ? FARTHEST : high);
    return uint(clamp(low, 0.0, FARTHEST)) | uint(clamp(high, 0.0, 65535.0)) << 16;
}
#endif
