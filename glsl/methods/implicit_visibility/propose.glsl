#ifndef PROPOSE
#define PROPOSE
// A sender's proposals to a receiver's bins.                                                       [Dong2007 4.2.2]
//
// The kernel binds moments, leaf_cells, cell_corners, keys, has params n, constants KIND, IS_SINGLE, IS_TURNED, and sets:
uint row_first_key;
Receiver at;
Surfel b;               // the sender, as seen: a cluster without a plane has its outline's normal and axes
uint sender;
vec3 offset;            // from receiver to sender
LeafCell cell;          // of a leaf

void propose(uint bin, float distance_there, bool is_back)
{
    uint64_t key = packUint2x32(uvec2(sender | (is_back ? BACK_SEEN : 0u), floatBitsToUint(distance_there)));
    if (key < keys[row_first_key + bin]) keys[row_first_key + bin] = key;
}

// A face's cells: the direction of the one at (u, v) is towards_face + u * along_u + v * along_v, in the world's axes.
vec3 towards_face, along_u, along_v;
uint first_bin;

// What of a cell the sender fills is told by three linear functions of its direction, and so of u and v.
vec3 w_0, w_u, w_v;
float reach_along;      // of a direction of length 1 over the last of them (planes) or their sum (triangles)
bool is_back;

vec3 functions_at(vec2 uv) { return w_0 + uv.x * w_u + uv.y * w_v; }

bool is_filled(vec3 w)
{
    if (KIND == OF_LEAVES) return min(w.y, w.z) >= 0.0 && w.x >= max(w.y, w.z) && w.x + w.y + w.z > 0.0;
    return w.x * w.x + w.y * w.y <= w.z * w.z && w.z * reach_along > 0.0;    // else parallel, or met behind the receiver
}

float distance_at(vec3 w, vec2 uv)
{
    return reach_along / (KIND == OF_LEAVES ? w.x + w.y + w.z : w.z) * sqrt(1.0 + dot(uv, uv));
}

vec2 centre_of(ivec2 at_cell) { return vec2(2 * at_cell + 1) / float(params.n) - 1.0; }

// In tiles of 8 x 4 cells: first which of them are filled, then their proposals, so that threads in lockstep with other
// cells to fill wait less for each other.
void fill_cells(ivec2 columns, ivec2 rows)
{
    for (int top = rows.x; top <= rows.y; top += 4) {
        for (int left = columns.x; left <= columns.y; left += 8) {
            ivec2 last = min(ivec2(left + 7, top + 3), ivec2(columns.y, rows.y));
            ivec2 at_cell = ivec2(left, top);
            uint filled = 0;
            while (at_cell.y <= last.y) {
                uint bit = uint(8 * (at_cell.y - top) + at_cell.x - left);
                filled |= is_filled(functions_at(centre_of(at_cell))) ? 1u << bit : 0u;
                at_cell = at_cell.x < last.x ? ivec2(at_cell.x + 1, at_cell.y) : ivec2(left, at_cell.y + 1);
            }
            while (filled != 0) {
                int bit = findLSB(filled);
                filled &= filled - 1;
                ivec2 here = ivec2(left + (bit & 7), top + (bit >> 3));
                vec2 uv = centre_of(here);
                propose(first_bin + uint(here.y) * params.n + uint(here.x), distance_at(functions_at(uv), uv), is_back);
            }
        }
    }
}

// The cell of a leaf is where its vertex has the largest barycentric coordinate of the triangles around it. Products of
// the direction with the triangle's edge planes are these coordinates, each up to the same factor.
void look_at_triangle(CellCorner corner, ivec2 columns, ivec2 rows)
{
    vec3 a = cell.vertex - at.origin, p = corner.p - at.origin, q = corner.q - at.origin;
    vec3 of_a = cross(p, q), of_p = cross(q, a), of_q = cross(a, p);
    float volume = dot(a, of_a);
    is_back = volume > 0.0 == ((cell.sides & CELL_OF_BACK) == 0);
    if (is_back && (cell.sides & CELL_HAS_OTHER_SIDE) != 0) return;     // another leaf shows this side
    float side = volume < 0.0 ? -1.0 : 1.0;
    w_u = side * vec3(dot(along_u, of_a), dot(along_u, of_p), dot(along_u, of_q));
    w_v = side * vec3(dot(along_v, of_a), dot(along_v, of_p), dot(along_v, of_q));
    w_0 = side * vec3(dot(towards_face, of_a), dot(towards_face, of_p), dot(towards_face, of_q));
    reach_along = abs(volume);
    fill_cells(columns, rows);
}

// The ellipse of a node: a direction meets its plane where plane / slope tells, and there it is inside or not.
void look_at_ellipse(ivec2 columns, ivec2 rows)
{
    float plane = dot(b.normal, offset);
    vec3 r = plane * b.g1 - dot(b.g1, offset) * b.normal, s = plane * b.g2 - dot(b.g2, offset) * b.normal;
    w_u = vec3(dot(along_u, r), dot(along_u, s), dot(along_u, b.normal));
    w_v = vec3(dot(along_v, r), dot(along_v, s), dot(along_v, b.normal));
    w_0 = vec3(dot(towards_face, r), dot(towards_face, s), dot(towards_face, b.normal));
    reach_along = plane;
    is_back = plane > 0.0;
    fill_cells(columns, rows);
}

void look_at(uint face, ivec2 columns, ivec2 rows)
{
    towards_face = face_direction(face, vec2(0.0));
    along_u = face_direction(face, vec2(1.0, 0.0)) - towards_face;
    along_v = face_direction(face, vec2(0.0, 1.0)) - towards_face;
    if (IS_TURNED != 0) {
        towards_face = turn(at.frame, towards_face);
        along_u = turn(at.frame, along_u);
        along_v = turn(at.frame, along_v);
    }
    first_bin = face * params.n * params.n;
    if (KIND == OF_LEAVES) {
        for (uint k = cell.first_corner; k < cell.first_corner + cell.corner_count; ++k)
            look_at_triangle(cell_corners[k], columns, rows);
    } else {
        look_at_ellipse(columns, rows);
    }
}

void link()
{
    vec3 local_offset = IS_TURNED != 0 ? turn_back(at.frame, offset) : offset;
    if (IS_SINGLE != 0) {
        propose(bin_of(local_offset, params.n), length(offset), dot(b.normal, offset) > 0.0);
        return;
    }
    float reach = b.radius;
    if (KIND == OF_LEAVES) {
        cell = leaf_cells[sender];
    } else {
        if (KIND == OF_OUTLINES) {
            b.normal = normalize(offset);
            shape_surfel(moments[sender], b);
            b.g1 *= SURFEL_REACH / SURFEL_OUTLINE;
            b.g2 *= SURFEL_REACH / SURFEL_OUTLINE;
        }
        // The longer semi-axis, from the smaller singular value of (g1, g2).
        float p = dot(b.g1, b.g1), q = dot(b.g1, b.g2), r = dot(b.g2, b.g2);
        float least = 0.5 * (p + r) - sqrt(0.25 * (p - r) * (p - r) + q * q);
        reach = least > 0.0 ? min(1.0 / sqrt(least), 4.0 * b.extent) : 4.0 * b.extent;
    }
    look_around(local_offset, reach, params.n);
}
#endif
