#ifndef LIB_FOOTPRINT
#define LIB_FOOTPRINT
// Which bins of a receiver a sender may fill: those whose centres a sphere around it covers, face by face.  [Dong2007 4.2.2]
#include "lib/bins.glsl"

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

// A walk over these cells. Where threads run in lockstep, each has its own cell and face in every turn.
struct CellWalk {
    vec3 offset;        // of the sphere's centre, in the axes of the bins
    float reach;        // its radius, m
    uint faces;         // still to come, bits
    uint face;
    int left;           // column that rows start at
    ivec2 cell;         // column and row
    ivec2 last;
};

void walk_rectangle(inout CellWalk w, vec2 range_u, vec2 range_v, uint n)
{
    ivec2 columns = cells_between(range_u, n), rows = cells_between(range_v, n);
    w.left = columns.x;
    w.cell = ivec2(columns.x, rows.x);
    w.last = ivec2(columns.y, columns.x <= columns.y ? rows.y : -1);
}

// To the next face with cells, where the present rectangle is done.
void find_rectangle(inout CellWalk w, uint n)
{
    while (w.last.y < w.cell.y && w.faces != 0) {
        w.face = uint(findLSB(w.faces));
        w.faces &= w.faces - 1;
        vec3 at = in_face(w.face, w.offset);
        bool is_inside = dot(w.offset, w.offset) <= w.reach * w.reach;
        walk_rectangle(w, is_inside ? vec2(-1.0, 1.0) : slope_range(at.x, at.z, w.reach),
                       is_inside ? vec2(-1.0, 1.0) : slope_range(at.y, at.z, w.reach), n);
    }
}

// Starts with the face that the centre lies in; others are those beyond the rims that the sphere crosses there.
CellWalk walk_cells(vec3 offset, float reach, uint n)
{
    CellWalk w = CellWalk(offset, reach, 0, face_of(offset), 0, ivec2(0), ivec2(-1));
    vec3 at = in_face(w.face, offset);
    if (at.z <= reach) {
        w.faces = 63;       // it reaches beside or behind the eye
    } else {
        vec2 range_u = slope_range(at.x, at.z, reach), range_v = slope_range(at.y, at.z, reach);
        uint axis = w.face >> 1, beside_u = 2 * (axis == 2 ? 0 : axis + 1), beside_v = 2 * (axis == 0 ? 2 : axis - 1);
        w.faces = (range_u.y >= 1.0 ? 1u << beside_u : 0u) | (range_u.x <= -1.0 ? 2u << beside_u : 0u)
                  | (range_v.y >= 1.0 ? 1u << beside_v : 0u) | (range_v.x <= -1.0 ? 2u << beside_v : 0u);
        walk_rectangle(w, range_u, range_v, n);
    }
    if (w.last.y < w.cell.y && w.faces != 0) find_rectangle(w, n);
    return w;
}

bool has_cell(CellWalk w) { return w.cell.y <= w.last.y; }

void next_cell(inout CellWalk w, uint n)
{
    w.cell = w.cell.x < w.last.x ? ivec2(w.cell.x + 1, w.cell.y) : ivec2(w.left, w.cell.y + 1);
    if (w.last.y < w.cell.y && w.faces != 0) find_rectangle(w, n);
}
#endif
