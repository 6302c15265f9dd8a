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

void propose(uint bin, float distance_there, bool is_back)
{
    uint64_t key = packUint2x32(uvec2(sender | (is_back ? BACK_SEEN : 0u), floatBitsToUint(distance_there)));
    if (key < keys[row_first_key + bin]) keys[row_first_key + bin] = key;
}

// Where a direction meets the sender, in lengths of the direction; FAR where it does not.
struct Meeting {
    float t;
    bool is_back;
};
const float FAR = 1e30;

// The cell of a leaf is where its vertex has the largest barycentric coordinate of the triangles around it.
Meeting meet_leaf(LeafCell cell, vec3 direction)
{
    Meeting nearest = Meeting(FAR, false);
    vec3 to_vertex = cell.vertex - at.origin;
    for (uint k = cell.first_corner; k < cell.first_corner + cell.corner_count; ++k) {
        CellCorner corner = cell_corners[k];
        float plane = dot(corner.across, to_vertex), t = plane / dot(corner.across, direction);
        vec3 there = t * direction - to_vertex;
        float p = dot(corner.along_p, there), q = dot(corner.along_q, there);
        bool is_back = plane > 0.0 == ((cell.sides & CELL_OF_BACK) == 0);
        // Of a two-sided surface another leaf shows the back.
        bool is_own = t > 0.0 && min(p, q) >= 0.0 && 1.0 - p - q >= max(p, q)
                      && !(is_back && (cell.sides & CELL_HAS_OTHER_SIDE) != 0);
        if (is_own && t < nearest.t) nearest = Meeting(t, is_back);
    }
    return nearest;
}

// The ellipse of a node; `r` and `s` are plane * g - dot(g, offset) * normal of its two axes.
Meeting meet_ellipse(float plane, vec3 r, vec3 s, vec3 direction)
{
    float slope = dot(b.normal, direction), x = dot(r, direction), y = dot(s, direction);
    bool is_met = slope * plane > 0.0 && x * x + y * y <= slope * slope;
    return Meeting(is_met ? plane / slope : FAR, plane > 0.0);
}

void link()
{
    vec3 local_offset = IS_TURNED != 0 ? turn_back(at.frame, offset) : offset;
    if (IS_SINGLE != 0) {
        propose(bin_of(local_offset, params.n), length(offset), dot(b.normal, offset) > 0.0);
        return;
    }
    float reach = b.radius, plane = 0.0;
    vec3 r = vec3(0.0), s = vec3(0.0);
    LeafCell cell = leaf_cells[KIND == OF_LEAVES ? sender : 0];
    if (KIND != OF_LEAVES) {
        if (KIND == OF_OUTLINES) {
            b.normal = normalize(offset);
            shape_surfel(moments[sender], b);
            b.g1 *= SURFEL_REACH / SURFEL_OUTLINE;
            b.g2 *= SURFEL_REACH / SURFEL_OUTLINE;
        }
        plane = dot(b.normal, offset);
        r = plane * b.g1 - dot(b.g1, offset) * b.normal;
        s = plane * b.g2 - dot(b.g2, offset) * b.normal;
        // The longer semi-axis, from the smaller singular value of (g1, g2).
        float g11 = dot(b.g1, b.g1), g12 = dot(b.g1, b.g2), g22 = dot(b.g2, b.g2);
        float least = 0.5 * (g11 + g22) - sqrt(0.25 * (g11 - g22) * (g11 - g22) + g12 * g12);
        reach = least > 0.0 ? min(1.0 / sqrt(least), 4.0 * b.extent) : 4.0 * b.extent;
    }
    CellWalk walk = walk_cells(local_offset, reach);
    while (next_cell(walk, params.n)) {
        vec2 uv = vec2(2 * walk.cell + 1) / float(params.n) - 1.0;
        vec3 direction = face_direction(walk.face, uv);
        if (IS_TURNED != 0) direction = turn(at.frame, direction);
        Meeting met = KIND == OF_LEAVES ? meet_leaf(cell, direction) : meet_ellipse(plane, r, s, direction);
        uint bin = (walk.face * params.n + uint(walk.cell.y)) * params.n + uint(walk.cell.x);
        if (met.t < FAR) propose(bin, met.t * sqrt(1.0 + dot(uv, uv)), met.is_back);
    }
}
#endif
