#ifndef GLOSSY_ARRIVAL
#define GLOSSY_ARRIVAL
// The kernel declares WORDS and BIN_COUNT, binds incident and peaks, has params.leaf_count, params.node_count and params.undershoot, and
// defines
//     vec3 beside(uint bin)       radiance that arrives beside what the table holds
#include "methods/antiradiance/floor.glsl"
#include "methods/antiradiance/table.glsl"

vec3 beside(uint bin);

// Radiance that arrives at a leaf along a bin; `mean`: of means, of the side that it arrives at.
vec3 glossy_arrival(uint leaf, uint node, uint parent, uint bin, vec3 mean)
{
    vec3 arriving = LOAD_ENTRY(incident, entry_of(node, bin, params.node_count));
    if (parent != NONE) arriving += LOAD_ENTRY(incident, entry_of(parent, bin, params.node_count));
    return max(arriving + beside(bin), lowest_of(peaks[bin * params.leaf_count + leaf], mean, params.undershoot));
}
#endif
