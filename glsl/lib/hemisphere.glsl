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
