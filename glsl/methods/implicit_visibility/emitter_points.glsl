#ifndef EMITTER_POINTS
#define EMITTER_POINTS
// Points on emitters as elements look for them.
struct PointSeen {
    vec3 position;          // m
    vec3 normal;            // unit; zero for a triangle without area
    uint is_double_sided;
};

// Where the ways to the points of a word of 32 samples end: within a box.
struct Bundle {
    vec3 middle;            // m
    vec3 half_size;         // m
};

// As shadow rays do, ways end a little before the emitter, on the side that is seen.
vec3 end_of_way(PointSeen point, bool is_back, float ray_offset)
{
    return point.position + (is_back ? -ray_offset : ray_offset) * point.normal;
}
#endif
