#ifndef LIB_BINS
#define LIB_BINS
// Direction bins: the texels of a cube map of n x n texels a face, about a receiver.                 [Dong2007 4.2.2]
// Faces +x, -x, +y, -y, +z, -z; within a face u runs along the axis after its own and v along the one after that.

const uint FACE_OF_Z = 4;               // its own axes are x, y, z
const uint EMPTY_BIN = 0xffffffffu;     // of a winner: nothing is seen
const uint BACK_SEEN = 0x80000000u;     // of a winner: it turns its back
const uint NODE_MASK = 0x7fffffffu;

// Where links are received: a node's centre, or for a leaf the point its rays would start from.
struct Receiver {
    vec3 origin;        // m
    vec3 normal;        // unit
    vec4 frame;         // quaternion that turns directions of its bins into world space
};

// The nodes of one level that the present window of receivers has.
struct WindowLevel {
    uint first;         // node
    uint count;
    uint row;           // of the first node, in the table of bins
};

// Up to 16 neighbouring nodes of one level that receive together: what all of them look at is decided once, for the node
// above that they are below.
struct ReceiverGroup {
    uint first;         // node
    uint count;
    uint node;          // two levels further up, or the root
    uint above_first;   // the same of the parents' group
    uint above_count;   // 0: nothing above receives in this window
    uint above_node;
    uint row;           // of the first node, in the table of bins
};

// How far a group has walked over all senders, and how many it holds for linking, by kind.
struct GroupWalk {
    uint step;
    uint left_from_above;   // step from which on the group above did not look
    uvec4 held;
};
const uint OF_LEAVES = 0;       // senders that are leaves, seen by their triangles
const uint OF_FLAT_LEAVES = 1;  // whose triangles lie in one plane
const uint OF_PLANES = 2;       // nodes about a plane, seen by their ellipses
const uint OF_OUTLINES = 3;     // nodes without one, seen by their outlines
const uint KINDS = 4;

// What was counted while links were made.
struct LinkCounts {
    uint visited;       // pairs of nodes
    uint proposed;      // of these, links
    uint kept;          // bins of leaves that have a winner
};

vec3 turn(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }
vec3 turn_back(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) - q.w * v); }

// Direction through (u, v) in -1..1 of a face, not of unit length: its component along the face's axis is +-1.
vec3 face_direction(uint face, vec2 uv)
{
    float side = (face & 1) == 0 ? 1.0 : -1.0;
    uint axis = face >> 1;
    return axis == 0 ? vec3(side, uv) : axis == 1 ? vec3(uv.y, side, uv.x) : vec3(uv, side);
}

// A direction in the face's own axes: (u, v, along its axis outwards).
vec3 in_face(uint face, vec3 d)
{
    float side = (face & 1) == 0 ? 1.0 : -1.0;
    uint axis = face >> 1;
    return axis == 0 ? vec3(d.yz, side * d.x) : axis == 1 ? vec3(d.z, d.x, side * d.y) : vec3(d.xy, side * d.z);
}

// And back.
vec3 from_face(uint face, vec3 at)
{
    float along = (face & 1) == 0 ? at.z : -at.z;
    uint axis = face >> 1;
    return axis == 0 ? vec3(along, at.xy) : axis == 1 ? vec3(at.y, along, at.x) : vec3(at.xy, along);
}

uint face_of(vec3 d)
{
    vec3 a = abs(d);
    uint axis = a.x >= a.y && a.x >= a.z ? 0u : a.y >= a.z ? 1u : 2u;
    float along = axis == 0 ? d.x : axis == 1 ? d.y : d.z;
    return 2 * axis + (along < 0.0 ? 1u : 0u);
}

// A whole number from 0 to 2^23 - 1, from the bits of its sum with 2^23: software drivers convert thread by thread.
uint as_uint(float whole) { return floatBitsToUint(whole + 8388608.0) & 0x7fffffu; }

uint bin_at(uint face, vec2 cell, uint n) { return face * n * n + as_uint(cell.y * float(n) + cell.x); }

uint bin_of(vec3 d, uint n)
{
    uint face = face_of(d);
    vec3 at = in_face(face, d);
    vec2 cell = min(floor(clamp(0.5 * at.xy / at.z + 0.5, 0.0, 1.0) * float(n)), vec2(n - 1));
    return bin_at(face, cell, n);
}

// Place in -1..1 of a cell's centre.
float cell_centre(uint cell, uint n) { return (2.0 * float(cell) + 1.0) / float(n) - 1.0; }

// Whether all of a bin lies below the plane across a normal; `uv` is its centre's place in -1..1 of the face.
bool is_below(uint face, vec2 uv, vec3 normal, uint n)
{
    vec3 up = in_face(face, normal);
    return dot(uv, up.xy) + up.z + (abs(up.x) + abs(up.y)) / float(n) <= 0.0;
}

// Towards the centre of a bin, not of unit length.
vec3 bin_direction(uint bin, uint n)
{
    uint in_map = bin % (n * n);
    return face_direction(bin / (n * n), vec2(cell_centre(in_map % n, n), cell_centre(in_map / n, n)));
}
#endif
