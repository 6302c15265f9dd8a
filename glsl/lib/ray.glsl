#ifndef LIB_RAY
#define LIB_RAY
// Rays and what they hit: the currency of everything that traces.

// The points origin + t direction with t_min <= t <= t_max; t is in units of the direction's length (metres where it
// is normalised; the length must lie in 1e-10..1e10, the origin within 1e15 of 0). A ray beyond that, with NaN, or with
// t_max < 0 is inactive: it hits nothing.
struct Ray {
    vec3 origin;
    float t_min;
    vec3 direction;
    float t_max; // may be infinite
};

// Of several hits at one t the lowest triangle index counts.
struct Hit {
    float t;           // along the ray; t_max of the ray where nothing was hit
    uint triangle;     // index | BACK_FACE where hit from behind its counter-clockwise front, or NO_HIT
    vec2 barycentrics; // weights of vertices 1 and 2
};

const uint NO_HIT = 0xffffffffu;
const uint BACK_FACE = 0x80000000u;

bool is_hit(Hit hit) { return hit.triangle != NO_HIT; }
uint triangle_index(Hit hit) { return hit.triangle & ~BACK_FACE; }
bool is_back_face(Hit hit) { return (hit.triangle & BACK_FACE) != 0; }

// Weights of vertices 0, 1 and 2.
vec3 barycentric_weights(Hit hit) { return vec3(1 - hit.barycentrics.x - hit.barycentrics.y, hit.barycentrics); }

// Bounded so that no product of the traversal overflows; a comparison with NaN is false.
bool is_active(Ray ray)
{
    vec3 origin = abs(ray.origin);
    float length_squared = dot(ray.direction, ray.direction);
    return ray.t_max >= 0 && ray.t_min <= ray.t_max && length_squared > 1e-20 && length_squared < 1e20
           && max(origin.x, max(origin.y, origin.z)) <= 1e15 && dot(origin, vec3(1)) < 1e16;
}
#endif
