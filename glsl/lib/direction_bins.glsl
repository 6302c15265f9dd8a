#ifndef LIB_DIRECTION_BINS
#define LIB_DIRECTION_BINS
// The sphere in m = 8 k^2 bins of equal area: each half of it (about +z, about -z) a square of 2k x 2k cells, k x k an
// octant, folded to the disc and lifted. Opposite directions lie in opposite bins.      [Shirley1997; octants as in Praun2003]
// Bins 2p and 2p + 1 are opposite, the first looks up (+z). A direction is always that of propagation, at the sender and
// at the receiver alike.
#include "lib/hemisphere.glsl"

// Bin of a unit direction; side = 2k.
uint bin_of(vec3 w, uint side)
{
    vec2 place = concentric_square(w.xy, sqrt(max(1.0 - abs(w.z), 0.0)));
    uvec2 cell = min(uvec2(max(place * float(side), vec2(0.0))), uvec2(side - 1));
    uint index = cell.y * side + cell.x;
    // Below, cells are counted from the end: there lies the one opposite to a cell above.
    return w.z < 0.0 ? 2 * (side * side - 1 - index) + 1 : 2 * index;
}

// A bin's direction as it is stored: x and y, two floats in a word that one load brings. The kernel binds
// uint64_t bin_directions[bin_count].
vec3 stored_direction(uint64_t xy, bool is_upper)
{
    vec2 p = uintBitsToFloat(unpackUint2x32(xy));
    float z = sqrt(max(1.0 - dot(p, p), 0.0));
    return vec3(p, is_upper ? z : -z);
}
#define BIN_DIRECTION(bin) stored_direction(bin_directions[bin], ((bin) & 1) == 0)

// |cosine| that stands for a whole bin at an element: never less than the mean over a bin that its plane cuts in two.
// `norm` makes the sum of cosine times bin solid angle over either side pi.
float discrete_cosine(float cosine, float norm, uint bin_count)
{
    return norm * max(abs(cosine), 0.5 / sqrt(float(bin_count)));
}

// What a kernel that makes links needs to know of the bins.
struct BinParams {
    uint side;              // 2k
    uint count;             // m
    uint class_count;       // of senders larger than a bin; 0: nothing is spread
    uint is_gaussian;       // larger senders are read in one bin and spread by a Gaussian
};

// An entry of a list of bins around a bin.
struct SpreadEntry {
    uint bin;
    float weight;
};
#endif
