#ifndef LIB_POLYGON
#define LIB_POLYGON
// Form factors from a point to flat polygons, exact near and far.
#include "lib/hemisphere.glsl"

struct SeenPolygon {
    float form_factor;  // of the part above the horizon; share of the point's hemisphere, cosine-weighted
    vec3 middle;        // mean of the corners of that part, relative to the point
};

// One edge's part of Lambert's sum: the angle it is seen under times how far its plane's normal leans to n.
float edge_term(vec3 a, vec3 b, vec3 n)
{
    vec3 across = cross(a, b);
    float sine = sqrt(dot(across, across));
    return sine > 0.0 ? atan(sine, dot(a, b)) * dot(across, n) / sine : 0.0;
}

// The polygon of `count` (3 or 4) corners relative to the point, clipped at the point's horizon; `n` is the point's unit
// normal. Counter-clockwise seen from the point or not: the sign is dropped.                             [Baum1989]
SeenPolygon seen_polygon(vec3 corners[4], uint count, vec3 n)
{
    vec3 kept[5];
    uint kept_count = 0;
    vec3 a = corners[count - 1];
    float height_a = dot(a, n);
    for (uint k = 0; k < count; ++k) {
        vec3 b = corners[k];
        float height_b = dot(b, n);
        if ((height_a > 0.0) != (height_b > 0.0)) kept[kept_count++] = mix(a, b, height_a / (height_a - height_b));
        if (height_b > 0.0) kept[kept_count++] = b;
        a = b;
        height_a = height_b;
    }
    if (kept_count < 3) return SeenPolygon(0.0, vec3(0.0));
    float sum = 0.0;
    vec3 middle = vec3(0.0);
    vec3 previous = kept[kept_count - 1];
    for (uint k = 0; k < kept_count; ++k) {
        sum += edge_term(previous, kept[k], n);
        middle += kept[k];
        previous = kept[k];
    }
    return SeenPolygon(abs(sum) / (2.0 * PI), middle / float(kept_count));
}
#endif
