#ifndef PROPOSE
#define PROPOSE
// A sender's proposals to a receiver's bins.                                                       [Dong2007 4.2.2]
//
// The kernel binds sender_texels, receiver_texels, corner_texels, keys, has params n, constants KIND, IS_SINGLE,
// IS_TURNED. Loops end where they are tested: where threads run in lockstep, one that is tested first runs once more.
#include "lib/footprint.glsl"
#include "lib/quadtree.glsl"
#include "lib/surfel.glsl"
#include "methods/implicit_visibility/horizon.glsl"
#include "methods/implicit_visibility/link_texels.glsl"

bool are_leaves()
{
    if (KIND == OF_LEAVES) return true;
    return KIND == OF_FLAT_LEAVES;
}

// What a thread keeps while it goes over receivers.
struct Sender {
    uint node;
    vec3 centre;
    Extents extents;
    vec3 half_axes[2];  // or moments; see link_texels.glsl
    vec3 vertex;        // or what a node has there
    uint first_corner;
    uint corner_count;
    uint sides;
};
Sender sender;

void hold_sender(uint node)
{
    int at = int(SENDER_TEXELS * node);
    vec4 centre = uintBitsToFloat(texelFetch(sender_texels, at)), normal = uintBitsToFloat(texelFetch(sender_texels, at + 1));
    uvec4 first = texelFetch(sender_texels, at + 2), second = texelFetch(sender_texels, at + 3);
    sender.node = node;
    sender.centre = centre.xyz;
    sender.extents = Extents(normal.xyz, centre.w, normal.w);
    sender.half_axes = vec3[](uintBitsToFloat(first.xyz), uintBitsToFloat(second.xyz));
    sender.first_corner = first.w;
    sender.corner_count = second.w >> 2;
    sender.sides = second.w & 3;
    sender.vertex = uintBitsToFloat(texelFetch(sender_texels, at + 4).xyz);
}

// Some of the triangles around a leaf: gradients of the barycentric coordinates of their other corners; of flat ones per
// half axis, p's and q's.
const uint HELD_CORNERS = 8;
vec3 along_p[HELD_CORNERS];
vec3 along_q[HELD_CORNERS];
vec4 along_both[HELD_CORNERS];

void hold_corners(uint from)
{
    [[unroll]] for (uint k = 0; k < HELD_CORNERS; ++k) {
        // The first texels are of no triangle: no place is in it.
        int at = int(CORNER_TEXELS * (from + k < sender.corner_count ? 1 + sender.first_corner + from + k : 0));
        if (KIND == OF_FLAT_LEAVES) {
            along_both[k] = uintBitsToFloat(texelFetch(corner_texels, at + 2));
        } else {
            along_p[k] = uintBitsToFloat(texelFetch(corner_texels, at).xyz);
            along_q[k] = uintBitsToFloat(texelFetch(corner_texels, at + 1).xyz);
        }
    }
}

// The cell of a leaf is where its vertex has the largest barycentric coordinate of the triangles around it: where p, q,
// 1 - 2 p - q and 1 - p - 2 q are not below zero; all times `one`. A number, below zero where one of them is: threads in
// lockstep branch for truths. With a little more room neighbours leave nothing between them, and a triangle its rim.
const float ROUNDING = 1e-6;

int is_beside_cell(float p, float q, float one)
{
    float room = ROUNDING * one, rest = one + room - (p + q);
    return floatBitsToInt(p + room) | floatBitsToInt(q + room) | floatBitsToInt(rest - p) | floatBitsToInt(rest - q);
}

// Where a direction meets the sender, in lengths of the direction; FAR where it does not.
struct Meeting {
    float t;
    bool is_back;
};
const float FAR = 1e30;

Meeting meet_leaf(vec3 to_vertex, vec3 direction)
{
    Meeting nearest = Meeting(FAR, false);
    [[unroll]] for (uint k = 0; k < HELD_CORNERS; ++k) {
        vec3 across = cross(along_p[k], along_q[k]);
        float plane = dot(across, to_vertex), t = plane / dot(across, direction);
        bool is_back = plane > 0.0 == ((sender.sides & CELL_OF_BACK) == 0);
        // Of a two-sided surface another leaf shows the back.
        bool is_shown = !is_back || (sender.sides & CELL_HAS_OTHER_SIDE) == 0;
        vec3 from_vertex = t * direction - to_vertex;
        bool is_nearer = t > 0.0 && t < nearest.t && is_shown
                         && is_beside_cell(dot(along_p[k], from_vertex), dot(along_q[k], from_vertex), 1.0) >= 0;
        nearest.t = is_nearer ? t : nearest.t;
        nearest.is_back = is_nearer ? is_back : nearest.is_back;
    }
    return nearest;
}

// An ellipse as a face's cells meet it, at `x / slope` and `y / slope` half axes of it, of a flat leaf's from its vertex:
// each by column, by row, and in the first cell. No slope above zero: behind the receiver.
struct EllipseInCells {
    vec3 x;
    vec3 y;
    vec3 slope;
};

vec3 in_cells(vec3 w, uint face, float per_bin)
{
    vec3 f = in_face(face, w);
    return vec3(2.0 * per_bin * f.xy, f.z + (per_bin - 1.0) * (f.x + f.y));
}

EllipseInCells ellipse_in_cells(SeenEllipse e, uint face, float per_bin)
{
    float side = e.volume < 0.0 ? -1.0 : 1.0;
    vec3 of_plane = side * e.of_plane, of_x = -side * e.of_b, of_y = side * e.of_a;
    if (KIND == OF_FLAT_LEAVES) {
        of_x -= sender.vertex.x * of_plane;
        of_y -= sender.vertex.y * of_plane;
    }
    return EllipseInCells(in_cells(of_x, face, per_bin), in_cells(of_y, face, per_bin), in_cells(of_plane, face, per_bin));
}

float in_cell(vec3 f, vec2 cell) { return f.x * cell.x + f.y * cell.y + f.z; }

// Whether a cell's centre sees a leaf's cell, a node's parallelogram or an outline's ellipse.
bool is_met(EllipseInCells e, vec2 cell)
{
    float slope = in_cell(e.slope, cell), x = in_cell(e.x, cell), y = in_cell(e.y, cell);
    if (KIND == OF_PLANES) return max(abs(x), abs(y)) <= IN_CORNERS * slope;
    if (KIND == OF_OUTLINES) return slope > 0.0 && x * x + y * y <= slope * slope;
    int is_beside = -1;
    [[unroll]] for (uint k = 0; k < HELD_CORNERS; ++k) {
        is_beside &= is_beside_cell(dot(along_both[k].xy, vec2(x, y)), dot(along_both[k].zw, vec2(x, y)), slope);
    }
    return (is_beside | floatBitsToInt(slope)) >= 0;
}

// Fronts of a body hide as many backs: these show for the most part where they are twice as many. All that looks either
// way is half the area where normals are spread evenly, so that then a sixth of the area more looks away than comes.
const float BACKS_SHOW = 1.0 / 6.0;

// Half axes of the outline of a cluster without a plane, as seen along a unit direction.
vec3[2] outline_axes(vec3 direction)
{
    SurfelMoments m = SurfelMoments(sender.half_axes[0], sender.half_axes[1], vec3(0.0));
    mat3 basis = basis_of(direction);
    vec3 mu = covariance_times(m, basis[0]), mv = covariance_times(m, basis[1]);
    float p = dot(basis[0], mu), q = dot(basis[0], mv), r = dot(basis[1], mv);
    float widest = 0.5 * (p + r) + sqrt(0.25 * (p - r) * (p - r) + q * q);
    p += 1e-4 * widest;
    r += 1e-4 * widest;
    // Cholesky factors of ((p, q), (q, r)).
    float l11 = sqrt(max(p, 1e-30)), l21 = q / l11, l22 = sqrt(max(r - l21 * l21, 0.0));
    return vec3[](SURFEL_OUTLINE * (l11 * basis[0] + l21 * basis[1]), SURFEL_OUTLINE * l22 * basis[1]);
}

// In -1..1 of a face.
vec2 bin_centre(vec2 cell, float per_bin) { return (2.0 * cell + 1.0) * per_bin - 1.0; }

void propose(uint place, float distance_there, bool is_back)
{
    uint64_t key = packUint2x32(uvec2(sender.node | (is_back ? BACK_SEEN : 0u), floatBitsToUint(distance_there)));
    atomicMin(keys[place], key);    // most are the nearest so far: to look first costs more than it saves
}

// To the receiver `at`, whose first bin is at `row`, unless `is_dropped`.
void link(Receiver at, uint row, bool is_dropped)
{
    vec3 offset = sender.centre - at.origin;
    bool is_behind = dot(sender.extents.normal, offset) > 0.0;
    vec3 axes[2] = sender.half_axes;
    if (KIND == OF_OUTLINES) {
        vec3 direction = normalize(offset);
        axes = outline_axes(direction);
        is_behind = dot(sender.vertex, direction) > BACKS_SHOW;
    }
    // Another leaf shows the back.
    if (KIND == OF_FLAT_LEAVES) is_dropped = is_dropped || (is_behind && (sender.sides & CELL_HAS_OTHER_SIDE) != 0);
    vec3 c = offset, to_vertex = sender.vertex - at.origin;
    if (KIND == OF_PLANES) c += sender.vertex;
    if (IS_TURNED != 0) {
        c = turn_back(at.frame, c);
        axes = vec3[](turn_back(at.frame, axes[0]), turn_back(at.frame, axes[1]));
    }
    if (IS_SINGLE != 0) {
        if (!is_dropped) propose(row + bin_of(c, params.n), length(offset), is_behind);
        return;
    }
    SeenEllipse seen = seen_ellipse(c, axes[0], axes[1]);
    if (KIND != OF_LEAVES) is_dropped = is_dropped || seen.volume == 0.0;       // edge on
    SeenOutline outline;
    if (KIND == OF_LEAVES) outline = seen_sphere(c, sender.extents.radius);
    else outline = outline_of(seen, c, axes[0], axes[1]);

    // Face by face, from that of the centre on.
    float per_bin = 1.0 / float(params.n);
    uint faces = 1u << face_of(c);
    bool is_first = true;
    do {
        uint face = uint(findLSB(faces));
        faces &= faces - 1;
        vec4 ranges = ranges_in_face(outline, face);
        if (is_first) faces = faces_beside(outline, face, ranges);
        is_first = false;
        CellWalk walk = walk_cells(ranges, params.n);
        if (is_dropped) walk.last.y = -1.0;
        EllipseInCells ellipse;
        if (KIND != OF_LEAVES) ellipse = ellipse_in_cells(seen, face, per_bin);
        do {
            Meeting met = Meeting(FAR, is_behind);
            if (KIND == OF_LEAVES) {
                vec3 direction = face_direction(face, bin_centre(walk.at, per_bin));
                met = meet_leaf(to_vertex, IS_TURNED != 0 ? turn(at.frame, direction) : direction);
            } else if (is_met(ellipse, walk.at)) {
                met.t = abs(seen.volume) / in_cell(ellipse.slope, walk.at);
            }
            vec2 uv = bin_centre(walk.at, per_bin);
            if (has_cell(walk) && met.t < FAR)
                propose(row + bin_at(face, walk.at, params.n), met.t * sqrt(1.0 + dot(uv, uv)), met.is_back);
            next_cell(walk);
        } while (has_cell(walk));
    } while (faces != 0 && !is_dropped);
}
#endif
