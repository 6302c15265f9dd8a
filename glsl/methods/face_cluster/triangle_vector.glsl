#ifndef FACE_CLUSTER_TRIANGLE_VECTOR
#define FACE_CLUSTER_TRIANGLE_VECTOR
// The exact irradiance vector of an evenly shining triangle.

vec3 edge_vector(vec3 p, vec3 q)
{
    vec3 across = cross(p, q);
    float sine = length(across);
    return sine > 0.0 ? across * (atan(sine, dot(p, q)) / (sine * 2.0 * PI)) : vec3(0.0);
}

// Irradiance vector at x of what lies above x's plane of a triangle of radiosity 1 that faces it: its edges' angles along
// their normals.                                                                               [Arvo1995 Eq. 2.5]
vec3 triangle_vector(vec3 x, vec3 normal, vec3 corners[3])
{
    vec3 sum = vec3(0.0), left = vec3(0.0), entered = vec3(0.0);
    bool is_cut = false;
    [[dont_unroll]] for (uint k = 0; k < 3; ++k) {
        vec3 p = corners[k] - x, q = corners[(k + 1) % 3] - x;
        float above_p = dot(p, normal), above_q = dot(q, normal);
        if (above_p <= 0.0 && above_q <= 0.0) continue;
        vec3 crossing = mix(p, q, above_p / (above_p - above_q));
        if (above_q <= 0.0) {
            left = q = crossing;
            is_cut = true;
        }
        if (above_p <= 0.0) entered = p = crossing;
        sum += edge_vector(p, q);
    }
    // Along the plane, where the triangle is cut off.
    if (is_cut) sum += edge_vector(left, entered);
    return sum;
}
#endif
