#ifndef FLOOR
#define FLOOR
// How far below zero what arrives in a bin may fall: a share of what arrived there, and of the mean over its side, before
// anything was taken away. A function of the scene's light alone, not of the steps so far.

// `peak`: of peaks[BIN_COUNT * leaf_count], of the mean; `mean`: of means[2 leaf_count], of the side that the bin arrives at
// (W m^-2 sr^-1). `undershoot` counts the bounces that are under way.
vec3 lowest_of(float peak, vec3 mean, float undershoot) { return -undershoot * max(1.0, peak) * mean; }
#endif
