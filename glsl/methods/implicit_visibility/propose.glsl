#ifndef PROPOSE
#define PROPOSE
// A sender's proposals to a receiver's bins.                                                       [Dong2007 4.2.2]
//
// The kernel binds moments, cell_corners, keys, has params n, constants KIND, IS_SINGLE, IS_TURNED, and sets:
uint sender;
Surfel b;
LeafCell cell;          // of a leaf
vec3 half_axes[2];      // of the ellipse of one that is flat, m
Receiver at;
vec3 offset;            // from receiver to sender

bool are_leaves()
{
    if (KIND == OF_LEAVES) return true;
    return KIND == OF_FLAT_LEAVES;
}

void propose(uint place, float distance_there, bool is_back)
{
    uint64_t key = packUint2x32(uvec2(sender | (is_back ? BACK_SEEN : 0u), floatBitsToUint(distance_there)));
    // What another thread writes meanwhile is nearer, not farther.
    if (key < keys[place]) atomicMin(keys[place], key);
}

// Some of the triangles around a leaf.
const uint HELD_CORNERS = 8;
CellCorner corners[HELD_CORNERS];
uint held_count;

void hold_corners(uint from)
{
    held_count = min(cell.corner_count - from, HELD_CORNERS);
    [[unroll]] for (uint k = 0; k < HELD_CORNERS; ++k) {
        if (k < held_count) corners[k] = cell_corners[cell.first_corner + from + k];
    }
}

// Where a direction meets the sender, in lengths of the direction; FAR where it does not.
struct Meeting {
    float t;
    bool is_back;
};
const float FAR = 1e30;

// The cell of a leaf is where its vertex has the largest barycentric coordinate of the triangles around it.
bool is_in_cell(CellCorner corner, vec3 from_vertex)
{
    float p = dot(corner.along_p, from_vertex), q = dot(corner.along_q, from_vertex);
    return min(p, q) >= 0.0 && 1.0 - p - q >= max(p, q);
}

Meeting meet_leaf(vec3 direction)
{
    Meeting nearest = Meeting(FAR, false);
    vec3 to_vertex = cell.vertex - at.origin;
    [[unroll]] for (uint k = 0; k < HELD_CORNERS; ++k) {
        if (k >= held_count) continue;
        float plane = dot(corners[k].across, to_vertex), t = plane / dot(corners[k].across, direction);
        bool is_back = plane > 0.0 == ((cell.sides & CELL_OF_BACK) == 0);
        // Of a two-sided surface another leaf shows the back.
        bool is_shown = !is_back || (cell.sides & CELL_HAS_OTHER_SIDE) == 0;
        bool is_nearer = t > 0.0 && t < nearest.t && is_shown && is_in_cell(corners[k], t * direction - to_vertex);
        nearest.t = is_nearer ? t : nearest.t;
        nearest.is_back = is_nearer ? is_back : nearest.is_back;
    }
    return nearest;
}

Meeting meet_flat_leaf(float plane, vec3 direction)
{
    float t = plane / dot(b.normal, direction);
    vec3 from_vertex = t * direction - (cell.vertex - at.origin);
    bool is_in = false;
    [[unroll]] for (uint k = 0; k < HELD_CORNERS; ++k) {
        if (k < held_count) is_in = is_in || is_in_cell(corners[k], from_vertex);
    }
    return Meeting(is_in && t > 0.0 ? t : FAR, plane > 0.0);
}

// The ellipse of a node about `normal`; `r` and `s` are plane * g - dot(g, offset) * normal of its two axes.
Meeting meet_ellipse(vec3 normal, float plane, vec3 r, vec3 s, vec3 direction)
{
    float slope = dot(normal, direction), x = dot(r, direction), y = dot(s, direction);
    bool is_met = slope * plane > 0.0 && x * x + y * y <= slope * slope;
    return Meeting(is_met ? plane / slope : FAR, plane > 0.0);
}

// Two half axes, conjugate to each other, of the ellipse that g1 and g2 stand for.
void hold_ellipse(Surfel s)
{
    vec3 along = cross(s.g2, s.normal), across = cross(s.normal, s.g1);
    float inverse = dot(s.g1, along);
    inverse = inverse != 0.0 ? 1.0 / inverse : 0.0;
    half_axes[0] = inverse * along;
    half_axes[1] = inverse * across;
}

vec3 in_bins(vec3 v) { return IS_TURNED != 0 ? turn_back(at.frame, v) : v; }

// `row`: place of the receiver's first bin.
void link(uint row)
{
    if (IS_SINGLE != 0) {
        propose(row + bin_of(in_bins(offset), params.n), length(offset), dot(b.normal, offset) > 0.0);
        return;
    }
    Surfel seen = b;
    float plane = 0.0;
    vec3 r = vec3(0.0), s = vec3(0.0);
    if (KIND == OF_FLAT_LEAVES) {
        plane = dot(b.normal, cell.vertex - at.origin);
        if (plane > 0.0 && (cell.sides & CELL_HAS_OTHER_SIDE) != 0) return;     // another leaf shows the back
    }
    if (!are_leaves()) {
        if (KIND == OF_OUTLINES) {
            // A cluster without a plane: its outline as seen from here.
            seen.normal = normalize(offset);
            shape_surfel(moments[sender], seen);
            seen.g1 *= SURFEL_REACH / SURFEL_OUTLINE;
            seen.g2 *= SURFEL_REACH / SURFEL_OUTLINE;
            hold_ellipse(seen);
        }
        plane = dot(seen.normal, offset);
        r = plane * seen.g1 - dot(seen.g1, offset) * seen.normal;
        s = plane * seen.g2 - dot(seen.g2, offset) * seen.normal;
    }
    SeenOutline outline;
    if (KIND == OF_LEAVES) outline = seen_sphere(in_bins(offset), b.radius);
    else outline = seen_ellipse(in_bins(offset), in_bins(half_axes[0]), in_bins(half_axes[1]));
    for (CellWalk walk = walk_cells(outline, params.n); has_cell(walk); next_cell(outline, walk, params.n)) {
        vec2 uv = vec2(2 * walk.cell + 1) / float(params.n) - 1.0;
        vec3 direction = face_direction(walk.face, uv);
        if (IS_TURNED != 0) direction = turn(at.frame, direction);
        Meeting met;
        if (KIND == OF_LEAVES) met = meet_leaf(direction);
        else if (KIND == OF_FLAT_LEAVES) met = meet_flat_leaf(plane, direction);
        else met = meet_ellipse(seen.normal, plane, r, s, direction);
        uint bin = (walk.face * params.n + uint(walk.cell.y)) * params.n + uint(walk.cell.x);
        if (met.t < FAR) propose(row + bin, met.t * sqrt(1.0 + dot(uv, uv)), met.is_back);
    }
}
#endif
