#ifndef LIB_SPLAT
#define LIB_SPLAT
// A flat patch as the splatting display shows it: a rectangle around its centre. Filled by stages/splats.
struct Splat {
    vec3 center;        // metres
    uint first_share;   // of the vertices whose light it shows
    vec3 half_u;        // half of its sides, metres; the front is where cross(half_u, half_v) points
    uint share_count;
    vec3 half_v;
    uint surface;       // the flat surface it is a part of
};

// A vertex whose light a splat shows.
struct SplatShare {
    uint vertex;
    float share;        // all of a splat sum to 1
};
const uint SPLAT_CORNERS = 6;   // of two triangles
// How far a splat reaches, in half sides: to the centres of the patches beside it.
const float SPLAT_REACH = 2.0;
#endif
