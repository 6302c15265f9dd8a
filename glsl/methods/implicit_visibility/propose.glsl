#ifndef PROPOSE
#define PROPOSE
// A sender's proposals to a receiver's bins.                                                       [Dong2007 4.2.2]
//
// The kernel binds what meet.glsl needs, receiver_texels, keys, has params n, constants IS_SINGLE, IS_TURNED. Loops end
// where they are tested: where threads run in lockstep, one that is tested first runs once more.
#include "lib/footprint.glsl"
#include "lib/surfel.glsl"
#include "methods/implicit_visibility/horizon.glsl"
#include "methods/implicit_visibility/link_texels.glsl"
#include "methods/implicit_visibility/meet.glsl"

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
