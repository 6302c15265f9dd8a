#ifndef LIB_SURFEL
#define LIB_SURFEL
// From moments to the ellipse of a surfel.
#include "lib/hemisphere.glsl"
#include "lib/quadtree.glsl"

// Semi-axes of the ellipse of an inner node in standard deviations of the surface's points. A disc of the surface's own
// area has 2; a rectangle lies within 2.45. Leaves' ellipses hold the corners of their cells.
const float SURFEL_REACH = 2.5;
// Of the outline of a cluster without a plane: what a sphere's has.
const float SURFEL_OUTLINE = 1.8;
// And of the disc whose solid angle the refinement looks at.
const float SURFEL_EXTENT = 2.0;

vec3 covariance_times(SurfelMoments m, vec3 v)
{
    return m.diagonal * v + vec3(m.mixed.x * v.y + m.mixed.z * v.z, m.mixed.x * v.x + m.mixed.y * v.z, m.mixed.z * v.x + m.mixed.y * v.y);
}

// The same of a normal and of what points against it.
vec3 one_of_both(vec3 n)
{
    bool is_turned = n.z < 0.0;
    if (n.z == 0.0) is_turned = n.y < 0.0;
    if (n.z == 0.0 && n.y == 0.0) is_turned = n.x < 0.0;
    return is_turned ? -n : n;
}

// Of the ellipse in which dot(g1, x)^2 + dot(g2, x)^2 <= 1: where one product is 1 and the other 0, m; zero without area.
vec3[2] half_axes(Surfel s)
{
    vec3 along = cross(s.g2, s.normal), across = cross(s.normal, s.g1);
    float inverse = dot(s.g1, along);
    inverse = inverse != 0.0 ? 1.0 / inverse : 0.0;
    return vec3[](inverse * along, inverse * across);
}

// The ellipse across `normal` of points with these moments, of both sides of a surface the same. A sliver gets a little
// width, so that it has an inside.
void shape_surfel(SurfelMoments m, inout Surfel s)
{
    s.g1 = s.g2 = vec3(0.0);
    s.extent = 0.0;
    if (s.normal == vec3(0.0)) return;
    mat3 basis = basis_of(one_of_both(s.normal));
    vec3 mu = covariance_times(m, basis[0]), mv = covariance_times(m, basis[1]);
    float p = dot(basis[0], mu), q = dot(basis[0], mv), r = dot(basis[1], mv);
    float widest = 0.5 * (p + r) + sqrt(0.25 * (p - r) * (p - r) + q * q);
    if (widest <= 0.0) return;
    p += 1e-4 * widest;
    r += 1e-4 * widest;
    // Cholesky factors of the inverse of ((p, q), (q, r)).
    float det = max(p * r - q * q, 1e-12 * widest * widest);
    float l11 = sqrt(r / det), l21 = -q / (det * l11), l22 = 1.0 / sqrt(r);
    s.g1 = (l11 * basis[0] + l21 * basis[1]) / SURFEL_REACH;
    s.g2 = (l22 * basis[1]) / SURFEL_REACH;
    s.extent = SURFEL_EXTENT * sqrt(widest);
}
#endif
