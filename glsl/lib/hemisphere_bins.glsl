#ifndef LIB_HEMISPHERE_BINS
#define LIB_HEMISPHERE_BINS
// Bins of equal solid angle over the hemisphere about +z: side x side cells of a square that is folded to a disc and lifted.
//                                                                                                         [Shirley1997]
#include "lib/hemisphere.glsl"

// Where a unit direction lies, in cells. One below the horizon is taken to it.
vec2 place_in_bins(vec3 w, uint side)
{
    vec2 p = w.xy / sqrt(w.z >= 0.0 ? 1.0 + w.z : max(1.0 - w.z * w.z, 1e-12));
    return float(side) * concentric_square(p, min(sqrt(dot(p, p)), 1.0));
}

// Unit direction of a place, in cells.
vec3 direction_in_bins(vec2 place, uint side)
{
    vec2 p = concentric_disc(place / float(side));
    float squared = dot(p, p);
    return vec3(p * sqrt(max(2.0 - squared, 0.0)), 1.0 - squared);
}

vec3 bin_middle(uint bin, uint side) { return direction_in_bins(vec2(bin % side, bin / side) + 0.5, side); }

float bin_solid_angle(uint side) { return 2.0 * PI / float(side * side); }

// Mean cosine to +z over a bin: of 1 - r^2, where r is the larger of both distances from the middle of the square.
float bin_cosine(uint bin, uint side)
{
    float width = 2.0 / float(side);
    vec2 p = abs((vec2(bin % side, bin / side) + 0.5) * width - 1.0);
    float larger = max(p.x, p.y), smaller = min(p.x, p.y);
    if (larger - smaller > 0.25 * width) return 1.0 - larger * larger - width * width / 12.0;
    // On a diagonal either may be the larger.
    float low = max(larger - 0.5 * width, 0.0), high = larger + 0.5 * width;
    float span = high - low, low3 = low * low * low, high3 = high * high * high;
    return 1.0 - 2.0 / (span * span) * (0.25 * (high3 * high - low3 * low) - low / 3.0 * (high3 - low3));
}

// One of the four bins around a direction, drawn by its share.
uint drawn_bin(vec3 w, uint side, vec2 u)
{
    vec2 at = place_in_bins(w, side) + u - 0.5;
    uvec2 cell = min(uvec2(max(at, vec2(0.0))), uvec2(side - 1));
    return cell.y * side + cell.x;
}
#endif
