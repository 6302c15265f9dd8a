#ifndef LIB_FOOTPRINT
#define LIB_FOOTPRINT
// Which bins of a receiver a sender may fill: those whose centres lie in the rectangles around its outline, face by face.
//                                                                                                 [Dong2007 4.2.2]
#include "lib/bins.glsl"

// The cone of directions in which an outline is seen: of an ellipse c + x a + y b, or of a sphere about c.
struct SeenOutline {
    vec3 centre;        // c
    vec3 diagonal;      // of the matrix c c' - a a' - b b', or c c' - r^2: xx, yy, zz
    vec3 mixed;         // xy, yz, zx
    vec3 spread;        // squares of the outline's half widths: (c x a)^2 + (c x b)^2 - (a x b)^2, or r^2 (c.c - r^2 - c^2)
};

// An ellipse as directions d meet it: at x = -(d . of_b) / (d . of_plane), y = (d . of_a) / (d . of_plane).
struct SeenEllipse {
    vec3 of_a;          // c x a
    vec3 of_b;          // c x b
    vec3 of_plane;      // a x b
    float volume;       // c . a x b
};

SeenEllipse seen_ellipse(vec3 c, vec3 a, vec3 b)
{
    vec3 across = cross(a, b);
    return SeenEllipse(cross(c, a), cross(c, b), across, dot(c, across));
}

SeenOutline outline_of(SeenEllipse e, vec3 c, vec3 a, vec3 b)
{
    vec3 spread = e.of_a * e.of_a + e.of_b * e.of_b - e.of_plane * e.of_plane;
    return SeenOutline(c, c * c - a * a - b * b, c * c.yzx - a * a.yzx - b * b.yzx, spread);
}

SeenOutline seen_sphere(vec3 c, float radius)
{
    float r = radius * radius;
    return SeenOutline(c, c * c - r, c * c.yzx, r * (dot(c, c) - r - c * c));
}

// Along a face's axis outwards, of vectors that mirroring does not turn.
float along_axis(uint face, vec3 v)
{
    uint axis = face >> 1;
    return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

// Ranges of u and v that a face shows of the outline, clamped to -1..1; empty where it lies behind.
vec4 ranges_in_face(SeenOutline o, uint face)
{
    uint axis = face >> 1;
    float side = (face & 1) == 0 ? 1.0 : -1.0, z = side * along_axis(face, o.centre), squared = along_axis(face, o.diagonal);
    if (squared <= 0.0) return vec4(-1.0, 1.0, -1.0, 1.0);      // it reaches beside or behind the eye
    if (z <= 0.0) return vec4(1.0, -1.0, 1.0, -1.0);
    vec2 middle = side * (axis == 0 ? o.mixed.xz : axis == 1 ? o.mixed.yx : o.mixed.zy);
    // Across u lies the cross product's part along v, and the other way round.
    vec2 spread = axis == 0 ? o.spread.zy : axis == 1 ? o.spread.xz : o.spread.yx;
    vec2 reach = sqrt(max(spread, vec2(0.0)));
    return clamp(vec4(middle - reach, middle + reach).xzyw / squared, -1.0, 1.0);
}

// The first and the last cell of a row whose centres lie between two places in -1..1.
vec2 cells_between(vec2 range, uint n)
{
    vec2 at = 0.5 * (range + 1.0) * float(n) - 0.5;
    return vec2(max(ceil(at.x), 0.0), min(floor(at.y), float(n) - 1.0));
}

// The faces beyond the rims that an outline crosses on the face that its centre lies in; all, where it reaches beside the eye.
uint faces_beside(SeenOutline o, uint face, vec4 ranges)
{
    uint axis = face >> 1, beside_u = 2 * (axis == 2 ? 0 : axis + 1), beside_v = 2 * (axis == 0 ? 2 : axis - 1);
    uint crossed = (ranges.y >= 1.0 ? 1u << beside_u : 0u) | (ranges.x <= -1.0 ? 2u << beside_u : 0u)
                   | (ranges.w >= 1.0 ? 1u << beside_v : 0u) | (ranges.z <= -1.0 ? 2u << beside_v : 0u);
    return along_axis(face, o.diagonal) <= 0.0 ? 63u & ~(1u << face) : crossed;
}

// The cells of a rectangle, row by row, in whole numbers; none where `last` lies before `at`.
struct CellWalk {
    vec2 at;            // column and row
    vec2 last;
    float left;         // column that rows start at
};

CellWalk walk_cells(vec4 ranges, uint n)
{
    vec2 columns = cells_between(ranges.xy, n), rows = cells_between(ranges.zw, n);
    return CellWalk(vec2(columns.x, rows.x), vec2(columns.y, columns.x <= columns.y ? rows.y : -1.0), columns.x);
}

bool has_cell(CellWalk w) { return w.at.y <= w.last.y; }

void next_cell(inout CellWalk w) { w.at = w.at.x < w.last.x ? vec2(w.at.x + 1.0, w.at.y) : vec2(w.left, w.at.y + 1.0); }
#endif
