#ifndef LIB_EMITTER
#define LIB_EMITTER
// Points on emissive triangles that stand for all of their light.
struct EmitterSample {
    uint triangle;
    vec2 barycentrics;      // of corners 1 and 2
    float share;            // of the triangle's area that this point stands for; above 1 where it stands for others too
    uint is_double_sided;
};

// A sample in world space.
struct EmitterPoint {
    vec3 position;
    vec3 normal;            // unit; zero for a triangle without area
    float area;             // m2
};

EmitterPoint emitter_point(EmitterSample at, vec3 a, vec3 b, vec3 c)
{
    vec3 across = cross(b - a, c - a);
    float twice_area = sqrt(dot(across, across));
    EmitterPoint point;
    point.position = a + at.barycentrics.x * (b - a) + at.barycentrics.y * (c - a);
    point.normal = twice_area > 0.0 ? across / twice_area : vec3(0.0);
    point.area = 0.5 * twice_area * at.share;
    return point;
}

// Cosine at the emitter of a unit direction that leaves it; negative behind a one-sided one.
float emitter_cosine(EmitterSample at, EmitterPoint point, vec3 direction)
{
    float cosine = dot(point.normal, direction);
    return at.is_double_sided != 0 ? abs(cosine) : cosine;
}
#endif
