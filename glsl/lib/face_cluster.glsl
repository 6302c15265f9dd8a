#ifndef LIB_FACE_CLUSTER
#define LIB_FACE_CLUSTER
// A node of a tree of face clusters.                                                          [Gobbetti2003 3.1]
struct FaceCluster {
    vec3 center;            // of the oriented box, metres
    vec4 rotation;          // unit quaternion to the box's axes; z along the area-averaged normal
    vec3 half_extent;       // metres along the axes
    float area;             // sum of the faces, m2
    float facing[6];        // sums of A (n.d)+ for d = x, -x, y, -y, z, -z of the box, m2
    uint albedo[3];         // least and mean, and the most of albedo and specular reflectance; shared exponent
    vec3 emission;          // mean, W m^-2 sr^-1
    uint emission_range[2]; // least and most; shared exponent
    uint first_face;        // in the order of the tree
    uint face_count;        // its lower bits; the others: what of the faces turned off the normal meets the cluster itself
};
const uint FACE_COUNT_BITS = 28u;

uint face_count(FaceCluster c) { return bitfieldExtract(c.face_count, 0, int(FACE_COUNT_BITS)); }

// Of what the faces send beyond the vector area, the share that strikes the cluster itself: 0 of a convex one, 1 of a
// hollow or a rough one.
float hollowness(FaceCluster c) { return float(c.face_count >> FACE_COUNT_BITS) / 15.0; }

vec3 rotated(vec4 q, vec3 v)
{
    vec3 t = 2.0 * cross(q.xyz, v);
    return v + q.w * t + cross(q.xyz, t);
}
#endif
