#ifndef FLOOR
#define FLOOR
// How far below zero what arrives in a bin may fall: a share of what arrived there, and of the mean over its side, before
// anything was taken away. A function of the scene's light alone, not of the steps so far.
// The kernel declares BIN_COUNT and binds means[2 leaf_count] (W m^-2 sr^-1) and peaks[leaf_count * BIN_COUNT] (of the mean).

// `side`: 0 front, 1 back. `undershoot` counts the bounces that are under way.
vec3 lowest_in(uint leaf, uint side, uint bin, float undershoot)
{
    return -undershoot * max(1.0, peaks[leaf * BIN_COUNT + bin]) * means[2 * leaf + side];
}
#endif
