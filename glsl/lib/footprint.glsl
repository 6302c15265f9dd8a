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

SeenOutline seen_ellipse(vec3 c, vec3 a, vec3 b)
{
    vec3 p = cross(c, a), q = cross(c, b), t = cross(a, b);
    return SeenOutline(c, c * c - a * a - b * b, c * c.yzx - a * a.yzx - b * b.yzx, p * p + q * q - t * t);
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

// Cells of a row whose centres lie between two places in -1..1.
ivec2 cells_between(vec2 range, uint n)
{
    vec2 at = 0.5 * (range + 1.0) * float(n) - 0.5;
    return clamp(ivec2(ceil(at.x), floor(at.y)), ivec2(0, -1), ivec2(n, int(n) - 1));
}

// A walk over these cells. Where threads run in lockstep, each has its own cell and face in every turn.
struct CellWalk {
    uint faces;         // still to come, bits
    uint face;
    int left;           // column that rows start at
    ivec2 cell;         // column and row
    ivec2 last;
};

void walk_rectangle(inout CellWalk w, vec4 ranges, uint n)
{
    ivec2 columns = cells_between(ranges.xy, n), rows = cells_between(ranges.zw, n);
    w.left = columns.x;
    w.cell = ivec2(columns.x, rows.x);
    w.last = ivec2(columns.y, columns.x <= columns.y ? rows.y : -1);
}

// To the next face with cells, where the present rectangle is done.
void find_rectangle(SeenOutline o, inout CellWalk w, uint n)
{
    while (w.last.y < w.cell.y && w.faces != 0) {
        w.face = uint(findLSB(w.faces));
        w.faces &= w.faces - 1;
        walk_rectangle(w, ranges_in_face(o, w.face), n);
    }
}

// Starts with the face that the centre lies in; others are those beyond the rims that the outline crosses there.
CellWalk walk_cells(SeenOutline o, uint n)
{
    CellWalk w = CellWalk(0, face_of(o.centre), 0, ivec2(0), ivec2(-1));
    if (along_axis(w.face, o.diagonal) <= 0.0) {
        w.faces = 63;       // it reaches beside or behind the eye
    } else {
        vec4 ranges = ranges_in_face(o, w.face);
        uint axis = w.face >> 1, beside_u = 2 * (axis == 2 ? 0 : axis + 1), beside_v = 2 * (axis == 0 ? 2 : axis - 1);
        w.faces = (ranges.y >= 1.0 ? 1u << beside_u : 0u) | (ranges.x <= -1.0 ? 2u << beside_u : 0u)
                  | (ranges.w >= 1.0 ? 1u << beside_v : 0u) | (ranges.z <= -1.0 ? 2u << beside_v : 0u);
        walk_rectangle(w, ranges, n);
    }
    if (w.last.y < w.cell.y && w.faces != 0) find_rectangle(o, w, n);
    return w;
}

bool has_cell(CellWalk w) { return w.cell.y <= w.last.y; }

void next_cell(SeenOutline o, inout CellWalk w, uint n)
{
    w.cell = w.cell.x < w.last.x ? ivec2(w.cell.x + 1, w.cell.y) : ivec2(w.left, w.cell.y + 1);
    if (w.last.y < w.cell.y && w.faces != 0) find_rectangle(o, w, n);
}
#endif
