#ifndef PROPOSE
#define PROPOSE
// A sender's proposals to a receiver's bins.                                                       [Dong2007 4.2.2]
//
// The kernel binds moments, leaf_cells, cell_corners, keys, has params n, is_single, is_turned, leaf_count, and sets:
uint row_first_key;
Receiver at;
Surfel b;               // the sender, as seen: a cluster without a plane has its outline's normal and axes
uint sender;
vec3 offset;            // from receiver to sender
LeafCell cell;          // of a leaf

bool is_leaf(uint node) { return node < params.leaf_count; }

void propose(uint bin, float distance_there, bool is_back)
{
    uint64_t key = packUint2x32(uvec2(sender | (is_back ? BACK_SEEN : 0u), floatBitsToUint(distance_there)));
    if (key < keys[row_first_key + bin]) keys[row_first_key + bin] = key;
}

// Towards a face's cells: the centre's direction is towards_face + u * along_u + v * along_v, in the world's axes.
vec3 towards_face, along_u, along_v;

// The cell of a leaf is where its vertex has the largest barycentric coordinate of the triangles around it. Products of
// the direction with the triangle's edge planes are these coordinates, each up to the same factor; they are linear in u, v.
void look_at_triangle(CellCorner corner, uint first_bin, ivec2 columns, ivec2 rows)
{
    vec3 a = cell.vertex - at.origin, p = corner.p - at.origin, q = corner.q - at.origin;
    vec3 of_a = cross(p, q), of_p = cross(q, a), of_q = cross(a, p);
    float volume = dot(a, of_a);
    bool is_back = volume > 0.0 == ((cell.sides & CELL_OF_BACK) == 0);
    if (is_back && (cell.sides & CELL_HAS_OTHER_SIDE) != 0) return;     // another leaf shows this side
    float side = volume < 0.0 ? -1.0 : 1.0;
    vec3 w_u = side * vec3(dot(along_u, of_a), dot(along_u, of_p), dot(along_u, of_q));
    vec3 w_v = side * vec3(dot(along_v, of_a), dot(along_v, of_p), dot(along_v, of_q));
    vec3 w_0 = side * vec3(dot(towards_face, of_a), dot(towards_face, of_p), dot(towards_face, of_q));
    for (int y = rows.x; y <= rows.y; ++y) {
        float v = cell_centre(uint(y), params.n);
        for (int x = columns.x; x <= columns.y; ++x) {
            float u = cell_centre(uint(x), params.n);
            vec3 w = w_0 + u * w_u + v * w_v;
            float sum = w.x + w.y + w.z;
            if (min(w.y, w.z) >= 0.0 && w.x >= max(w.y, w.z) && sum > 0.0)
                propose(first_bin + uint(y) * params.n + uint(x), abs(volume) / sum * sqrt(1.0 + u * u + v * v), is_back);
        }
    }
}

// The ellipse of a node.
void look_at_ellipse(uint first_bin, ivec2 columns, ivec2 rows)
{
    float plane = dot(b.normal, offset);
    for (int y = rows.x; y <= rows.y; ++y) {
        float v = cell_centre(uint(y), params.n);
        for (int x = columns.x; x <= columns.y; ++x) {
            float u = cell_centre(uint(x), params.n);
            vec3 direction = towards_face + u * along_u + v * along_v;
            float slope = dot(b.normal, direction);
            if (slope * plane <= 0.0) continue;     // parallel, or met behind the receiver
            float t = plane / slope;
            vec3 from_centre = t * direction - offset;
            float r = dot(b.g1, from_centre), s = dot(b.g2, from_centre);
            if (r * r + s * s <= 1.0)
                propose(first_bin + uint(y) * params.n + uint(x), t * sqrt(1.0 + u * u + v * v), plane > 0.0);
        }
    }
}

void look_at(uint face, ivec2 columns, ivec2 rows)
{
    towards_face = face_direction(face, vec2(0.0));
    along_u = face_direction(face, vec2(1.0, 0.0)) - towards_face;
    along_v = face_direction(face, vec2(0.0, 1.0)) - towards_face;
    if (params.is_turned != 0) {
        towards_face = turn(at.frame, towards_face);
        along_u = turn(at.frame, along_u);
        along_v = turn(at.frame, along_v);
    }
    uint first_bin = face * params.n * params.n;
    if (is_leaf(sender)) {
        for (uint k = cell.first_corner; k < cell.first_corner + cell.corner_count; ++k)
            look_at_triangle(cell_corners[k], first_bin, columns, rows);
    } else {
        look_at_ellipse(first_bin, columns, rows);
    }
}

void link()
{
    vec3 local_offset = params.is_turned == 0 ? offset : turn_back(at.frame, offset);
    if (params.is_single != 0) {
        propose(bin_of(local_offset, params.n), length(offset), dot(b.normal, offset) > 0.0);
        return;
    }
    float reach = b.radius;
    if (is_leaf(sender)) {
        cell = leaf_cells[sender];
    } else {
        if (b.cos_cone < 0.5) {
            // A cluster without a plane: its outline as seen from here.
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
