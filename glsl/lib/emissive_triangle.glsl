#ifndef LIB_EMISSIVE_TRIANGLE
#define LIB_EMISSIVE_TRIANGLE
// Emissive triangles, drawn by an alias table. Filled by stages/emissive_triangles.

struct EmissiveTriangle {
    uint triangle;
    float threshold;    // of the alias table, 0..1
    uint alias;
    float density;      // of points on the triangle: probability / area, m^-2
};

// Size and brightness of a triangle, from which its probability is made.
struct EmissiveMeasure {
    float area;         // m2
    float emission;     // mean over the triangle and over the colour channels, W m^-2 sr^-1
};

// Index of the entry that two random words choose among `count`.
uint alias_slot(uint word, uint count)
{
    uint high, low;
    umulExtended(word, count, high, low);
    return high;
}

// Barycentric weights, uniform over a triangle.
vec3 uniform_weights(vec2 u)
{
    float root = sqrt(u.x);
    return vec3(1.0 - root, root * (1.0 - u.y), root * u.y);
}
#endif
