#ifndef LIB_FACE_ELEMENT
#define LIB_FACE_ELEMENT
// Elements of face-cluster radiosity: clusters placed in the world, grown only where light asks for them.
#include "lib/face_cluster.glsl"
#include "lib/hemisphere.glsl"

// One side of one placed mesh.
struct ClusterInstance {
    mat4x3 world_from_tree; // rotation, one scale, translation
    float scale;
    uint is_back;           // 1: the clockwise side of its faces
    uint first_cluster;     // of its tree in the table of clusters
    uint first_face;        // of its tree in the table of faces
    uint first_triangle;    // of the scene: place 0 of the tree
};

struct FaceElement {
    uint cluster;
    uint instance;
    uint parent;            // NO_FACE_ELEMENT for the root of an instance
    uint children;          // the first of two, or NO_FACE_ELEMENT
    uint level;
    uint first_place;       // its faces, in the order of all trees
    uint place_count;
    float self_share;       // of what it sends, what strikes itself
    vec3 center;            // metres, world
    vec3 axis_x;            // unit
    vec3 axis_y;
    vec3 axis_z;            // along the mean normal of its side
    vec3 half_extent;       // metres
    float area;             // m2
    float facing[6];        // as in FaceCluster, of this side
    vec3 albedo;            // mean
    float most_albedo;      // of all channels
    vec3 emission;          // mean, W m^-2 sr^-1
    uint is_part_hidden;    // 1: some of its nodes lie inside other bodies, not all
};
const uint NO_FACE_ELEMENT = 0xffffffffu;

// What becomes of a (receiver, shooter) pair.
const uint PAIR_IS_DONE = 0u;
const uint SPLIT_RECEIVER = 1u;
const uint SPLIT_SHOOTER = 2u;
const uint SPLIT_BOTH = 3u;     // a self transfer: all pairs of its children
const uint PAIR_WAITS = 4u;     // for elements: the pool is full, and the host makes it larger
const uint IN_SHADOW = 0x40000000u; // of a decision to split, and of the halves' shooters: some ray was blocked
const uint IS_LIGHT = 0x80000000u;  // of a shooter: an index of the table of lights

struct PoolCounters {
    uint element_count;
    uint made_count;        // of those, finished
    uint is_full;
    uint transfers;         // pairs that passed light on
    uint rays;
    uint largest_unshot;    // bits of a float, W/m2
    uint deepest_level;
};

// Normal-projected area, m2: the length of the vector area.                                    [Gobbetti2003 3.1]
float vector_area(FaceElement e) { return max(e.facing[4] - e.facing[5], 0.0); }

// Whether the faces look so many ways that light from behind the mean normal reaches much of them: two at a right angle
// do, of which it is 0.707.
bool is_bent(FaceElement e) { return vector_area(e) < 0.8 * e.area; }

// What nodes may miss of what is free of partly hidden faces, as a share of it.
const float MISSED_SHARE = 0.25;

// Whether light must meet the faces apart: bent ones where it is bright, and partly hidden ones where what nodes may miss
// of what is reflected is more than `threshold`, both in W.
bool is_met_apart(FaceElement e, bool is_bright, float reflected, float threshold)
{
    return is_bent(e) && is_bright || e.is_part_hidden != 0 && MISSED_SHARE * reflected > threshold;
}

// Whether the faces lie in one plane, nearly.
bool is_flat(FaceElement e) { return e.place_count == 1 || vector_area(e) > 0.99 * e.area; }

// Bounds of the area projected towards a unit direction, m2.                                   [Gobbetti2003 3.1]
float least_projected_area(FaceElement e, vec3 direction)
{
    return vector_area(e) * max(dot(e.axis_z, direction), 0.0);
}

float most_projected_area(FaceElement e, vec3 direction)
{
    vec3 d = vec3(dot(e.axis_x, direction), dot(e.axis_y, direction), dot(e.axis_z, direction));
    return max(d.x, 0.0) * e.facing[0] + max(-d.x, 0.0) * e.facing[1]
         + max(d.y, 0.0) * e.facing[2] + max(-d.y, 0.0) * e.facing[3]
         + max(d.z, 0.0) * e.facing[4] + max(-d.z, 0.0) * e.facing[5];
}

// Area projected towards a unit direction as it is expected between its bounds, m2: of faces whose normals lie evenly
// around the mean one, as a ball's (a quarter of all to every side), a half ball's, or a cap's: all that turns to the
// direction above some height, nothing below as much. It is larger than towards the other side by what the vector area
// is, and over all directions pi times the area that does not face itself.
float projected_area(FaceElement e, vec3 direction)
{
    float flat_area = vector_area(e), along = dot(e.axis_z, direction);
    float open = max((1.0 - e.self_share) * e.area, flat_area), share = flat_area / max(open, 1e-30);
    float expected;
    if (share > 0.75) {
        float height = sqrt(max(3.0 / share - 3.0, 0.0));
        expected = flat_area * (along >= height ? along : along <= -height ? 0.0 : (along + height) * (along + height) / (4.0 * height));
    } else {
        expected = open * (0.25 + 0.5 * share * along + 0.75 * max(share - 0.5, 0.0) * (along * along - 1.0 / 3.0));
    }
    return min(expected, most_projected_area(e, direction));
}

// How far the box reaches from its centre along a unit direction, metres.
float reach(FaceElement e, vec3 direction)
{
    return e.half_extent.x * abs(dot(e.axis_x, direction)) + e.half_extent.y * abs(dot(e.axis_y, direction))
         + e.half_extent.z * abs(dot(e.axis_z, direction));
}

// From a place to an element's box, m2.
float squared_distance(FaceElement e, vec3 x)
{
    vec3 d = x - e.center;
    vec3 off = max(abs(vec3(dot(d, e.axis_x), dot(d, e.axis_y), dot(d, e.axis_z))) - e.half_extent, vec3(0.0));
    return max(dot(off, off), 1e-20);
}

// Whether any face of `e` may look at anything in the box of `other`.
bool may_face(FaceElement e, FaceElement other)
{
    vec3 offset = other.center - e.center;
    vec3 axes[3] = vec3[3](e.axis_x, e.axis_y, e.axis_z);
    float tolerance = 1e-5 * (e.half_extent.x + e.half_extent.y + other.half_extent.x + other.half_extent.y);
    for (uint k = 0; k < 6; ++k) {
        if (e.facing[k] <= 1e-3 * e.area) continue;
        vec3 axis = (k & 1u) == 0 ? axes[k >> 1] : -axes[k >> 1];
        if (dot(offset, axis) + reach(e, axis) + reach(other, axis) > tolerance) return true;
    }
    return false;
}

// A point of the element's horizontal plane; (0, 0) and (1, 1) are corners of its box.
vec3 plane_point(FaceElement e, vec2 uv)
{
    vec2 d = (2.0 * uv - 1.0) * e.half_extent.xy;
    return e.center + d.x * e.axis_x + d.y * e.axis_y;
}

vec2 plane_coordinates(FaceElement e, vec3 point)
{
    vec3 d = point - e.center;
    vec2 along = vec2(dot(d, e.axis_x), dot(d, e.axis_y));
    return 0.5 + 0.5 * along / max(e.half_extent.xy, vec2(1e-30));
}
#endif
