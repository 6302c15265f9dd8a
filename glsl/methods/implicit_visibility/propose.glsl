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

// Some of the triangles around a leaf: gradients of the barycentric coordinates of their other corners, of flat ones per
// half axis.
const uint HELD_CORNERS = 8;
vec3 along_p[HELD_CORNERS];
vec3 along_q[HELD_CORNERS];

void hold_corners(uint from)
{
    [[unroll]] for (uint k = 0; k < HELD_CORNERS; ++k) {
        bool is_held = from + k < sender.corner_count;
        int at = is_held ? int(CORNER_TEXELS * (sender.first_corner + from + k)) : 0;
        vec3 p = uintBitsToFloat(texelFetch(corner_texels, at).xyz), q = uintBitsToFloat(texelFetch(corner_texels, at + 1).xyz);
        if (KIND == OF_FLAT_LEAVES) {
            p = vec3(dot(p, sender.half_axes[0]), dot(p, sender.half_axes[1]), 0.0);
            q = vec3(dot(q, sender.half_axes[0]), dot(q, sender.half_axes[1]), 0.0);
        }
        // No place is beyond all bounds.
        along_p[k] = is_held ? p : vec3(1e20);
        along_q[k] = is_held ? q : vec3(1e20);
    }
}

// The cell of a leaf is where its vertex has the largest barycentric coordinate of the triangles around it. A number, not a
// truth: threads in lockstep branch for truths.
uint is_in_cell(float p, float q) { return uint(p >= 0.0) & uint(q >= 0.0) & uint(2.0 * p + q <= 1.0) & uint(p + 2.0 * q <= 1.0); }

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
                         && is_in_cell(dot(along_p[k], from_vertex), dot(along_q[k], from_vertex)) != 0;
        nearest.t = is_nearer ? t : nearest.t;
        nearest.is_back = is_nearer ? is_back : nearest.is_back;
    }
    return nearest;
}

// On the plane of a leaf's cell or of a node's parallelogram, or on an outline's ellipse; `x` and `y` by `slope` tell where.
float meet_ellipse(SeenEllipse e, vec3 direction)
{
    float slope = dot(e.of_plane, direction), x = dot(e.of_b, direction), y = dot(e.of_a, direction);
    float t = e.volume / slope;
    if (KIND == OF_PLANES) return t > 0.0 && max(abs(x), abs(y)) <= IN_CORNERS * abs(slope) ? t : FAR;
    if (KIND == OF_OUTLINES) return t > 0.0 && x * x + y * y <= slope * slope ? t : FAR;
    vec2 from_vertex = vec2(-x, y) / slope - sender.vertex.xy;
    uint is_in = 0;
    [[unroll]] for (uint k = 0; k < HELD_CORNERS; ++k) {
        is_in |= is_in_cell(dot(along_p[k].xy, from_vertex), dot(along_q[k].xy, from_vertex));
    }
    return is_in != 0 && t > 0.0 ? t : FAR;
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

void propose(uint place, float distance_there, bool is_back)
{
    uint64_t key = packUint2x32(uvec2(sender.node | (is_back ? BACK_SEEN : 0u), floatBitsToUint(distance_there)));
    // What another thread writes meanwhile is nearer, not farther.
    if (key < keys[place]) atomicMin(keys[place], key);
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
    SeenOutline outline;
    if (KIND == OF_LEAVES) outline = seen_sphere(c, sender.extents.radius);
    else outline = outline_of(seen, c, axes[0], axes[1]);

    // Face by face, from that of the centre on.
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
        do {
            vec2 uv = (2.0 * walk.at + 1.0) / float(params.n) - 1.0;
            vec3 direction = face_direction(face, uv);
            Meeting met;
            if (KIND == OF_LEAVES) met = meet_leaf(to_vertex, IS_TURNED != 0 ? turn(at.frame, direction) : direction);
            else met = Meeting(meet_ellipse(seen, direction), is_behind);
            if (has_cell(walk) && met.t < FAR)
                propose(row + bin_at(face, walk.at, params.n), met.t * sqrt(1.0 + dot(uv, uv)), met.is_back);
            next_cell(walk);
        } while (has_cell(walk));
    } while (faces != 0 && !is_dropped);
}
#endif
