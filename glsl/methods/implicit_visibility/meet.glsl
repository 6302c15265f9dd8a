#ifndef MEET
#define MEET
// A sender that a thread keeps, and where the centres of bins meet it.                             [Dong2007 4.2.2]
//
// The kernel binds sender_texels, corner_texels, and has the constant KIND.
#include "lib/footprint.glsl"
#include "lib/quadtree.glsl"
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
#endif
