#ifndef LIB_SKY_SPOT
#define LIB_SKY_SPOT
// All light of a bright part of the environment, from one direction; see scene::environment.
struct SkySpot {
    vec3 direction;     // unit, towards it
    vec3 irradiance;    // on a surface across it, W/m2
};
#endif
