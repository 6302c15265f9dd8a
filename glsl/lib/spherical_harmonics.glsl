#ifndef LIB_SPHERICAL_HARMONICS
#define LIB_SPHERICAL_HARMONICS
// Real spherical harmonics of bands 0 and 1, orthonormal over the sphere, in the order 1, y, z, x.      [Ramamoorthi2001]
struct ArrivingLight {
    vec3 constant;          // integral of radiance times the function: W/m2 per steradian of the function's norm
    vec3 along_y;
    vec3 along_z;
    vec3 along_x;
};

const float SH_CONSTANT = 0.28209479;   // 1 / (2 sqrt pi)
const float SH_LINEAR = 0.48860251;     // sqrt(3 / (4 pi))

// Adds light of `irradiance` (W/m2, on a plane facing it) from a unit direction.
void add_arriving(inout ArrivingLight sum, vec3 irradiance, vec3 direction)
{
    sum.constant += SH_CONSTANT * irradiance;
    sum.along_y += SH_LINEAR * direction.y * irradiance;
    sum.along_z += SH_LINEAR * direction.z * irradiance;
    sum.along_x += SH_LINEAR * direction.x * irradiance;
}
#endif
