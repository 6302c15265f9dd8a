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
    uint first_face;        // lower bits: in the order of the tree; upper: of what is turned off the normal, by backs
    uint face_count;        // lower bits; upper: of what is turned off the normal, what meets the cluster itself, by fronts
};
const uint INDEX_BITS = 28u;

uint face_count(FaceCluster c) { return bitfieldExtract(c.face_count, 0, int(INDEX_BITS)); }
uint first_face(FaceCluster c) { return bitfieldExtract(c.first_face, 0, int(INDEX_BITS)); }

// Of what one side of the faces sends beyond the vector area, the share that meets the cluster itself if nothing stands
// between: 0 where no face sees another.                                                       [Gobbetti2003 3.3.3]
float self_share(FaceCluster c, bool back)
{
    uint level = (back ? c.first_face : c.face_count) >> INDEX_BITS;
    return level == 0 ? 0.0 : exp2(0.5 * (float(level) - 15.0));
}

vec3 rotated(vec4 q, vec3 v)
{
    vec3 t = 2.0 * cross(q.xyz, v);
    return v + q.w * t + cross(q.xyz, t);
}
#endif
