#ifndef LIB_FOOTPRINT
#define LIB_FOOTPRINT
// Which bins of a receiver a surfel fills, and how far away it is there.                            [Dong2007 4.2.2]
//
// Bridge: the kernel takes each bin's proposal.
#include "lib/bins.glsl"
#include "lib/quadtree.glsl"
void propose(uint bin, float distance_there);

// Range of x / z over a sphere around (x, z) seen from the origin, clamped to -1..1; empty where it lies behind.
vec2 slope_range(float x, float z, float radius)
{
    if (z <= -radius) return vec2(1.0, -1.0);
    float denominator = z * z - radius * radius;
    if (z <= radius || denominator <= 0.0) return vec2(-1.0, 1.0);     // it reaches beside or behind the eye
    float s = radius * sqrt(max(x * x + denominator, 0.0));
    return clamp(vec2(x * z - s, x * z + s) / denominator, -1.0, 1.0);
}

// Cells of a row whose centres lie between two places in -1..1.
ivec2 cells_between(vec2 range, uint n)
{
    vec2 at = 0.5 * (range + 1.0) * float(n) - 0.5;
    return clamp(ivec2(ceil(at.x), floor(at.y)), ivec2(0, -1), ivec2(n, int(n) - 1));
}

// Proposes the surfel to each bin whose central direction meets its ellipse. `offset` leads from the receiver to the
// centre, all in the receiver's frame; `reach` bounds the ellipse.
void propose_footprint(vec3 offset, vec3 normal, vec3 g1, vec3 g2, float reach, uint n)
{
    float plane = dot(normal, offset);
    bool is_inside = dot(offset, offset) <= reach * reach;
    // The face that the centre lies in first: few surfels reach over to others.
    uint main_face = face_of(offset), face = main_face;
    for (uint k = 0; k < 6; ++k) {
        vec3 at = in_face(face, offset);
        vec2 range_u = vec2(-1.0, 1.0), range_v = vec2(-1.0, 1.0);
        if (!is_inside) {
            range_u = slope_range(at.x, at.z, reach);
            range_v = slope_range(at.y, at.z, reach);
        }
        ivec2 columns = cells_between(range_u, n), rows = cells_between(range_v, n);
        for (int y = rows.x; y <= rows.y; ++y) {
            for (int x = columns.x; x <= columns.y; ++x) {
                vec3 direction = face_direction(face, vec2(cell_centre(uint(x), n), cell_centre(uint(y), n)));
                float slope = dot(normal, direction);
                if (slope * plane <= 0.0) continue;     // parallel, or met behind the receiver
                float t = plane / slope;
                vec3 from_centre = t * direction - offset;
                float a = dot(g1, from_centre), b = dot(g2, from_centre);
                if (a * a + b * b <= 1.0)
                    propose((face * n + uint(y)) * n + uint(x), t * length(direction));
            }
        }
        bool stays = range_u.x > -1.0 && range_u.y < 1.0 && range_v.x > -1.0 && range_v.y < 1.0;
        if (k == 0 && stays) break;
        face = k < main_face ? k : k + 1;       // then all others in turn
    }
}
#endif
