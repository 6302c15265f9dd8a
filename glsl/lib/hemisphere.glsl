#ifndef LIB_HEMISPHERE
#define LIB_HEMISPHERE
// Directions over the hemisphere above a normal.

const float PI = 3.14159265358979;

// Unit square to unit disc, keeping areas in proportion and neighbours together.          [Shirley1997]
vec2 concentric_disc(vec2 u)
{
    vec2 p = 2.0 * u - 1.0;
    if (p.x == 0.0 && p.y == 0.0) return vec2(0.0);
    float r, phi;
    if (abs(p.x) > abs(p.y)) {
        r = p.x;
        phi = (PI / 4.0) * (p.y / p.x);
    } else {
        r = p.y;
        phi = (PI / 2.0) - (PI / 4.0) * (p.x / p.y);
    }
    return r * vec2(cos(phi), sin(phi));
}

// The place in the unit square that concentric_disc takes to distance `r` along the direction of `p`.
vec2 concentric_square(vec2 p, float r)
{
    vec2 q = vec2(0.0);
    if (p.x != 0.0 || p.y != 0.0) {
        if (abs(p.x) > abs(p.y)) {
            q.x = p.x > 0.0 ? r : -r;
            q.y = q.x * atan(p.y / p.x) * (4.0 / PI);
        } else {
            q.y = p.y > 0.0 ? r : -r;
            q.x = q.y * atan(p.x / p.y) * (4.0 / PI);
        }
    }
    return 0.5 * q + 0.5;
}

// Cosine-weighted direction about +z from a point of the unit square: the disc lifted to the hemisphere.
vec3 cosine_hemisphere(vec2 u)
{
    vec2 d = concentric_disc(u);
    return vec3(d, sqrt(max(1.0 - dot(d, d), 0.0)));
}

// An orthonormal basis with the unit vector n as its third column, without a branch near the poles.   [Duff2017]
mat3 basis_of(vec3 n)
{
    float s = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + n.z);
    float b = n.x * n.y * a;
    return mat3(vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3(b, s + n.y * n.y * a, -n.y), n);
}
#endif
