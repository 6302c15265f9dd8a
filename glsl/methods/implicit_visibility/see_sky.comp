#version 460
#include "lib/prelude.glsl"
#include "lib/bins.glsl"
#include "lib/quadtree.glsl"
#include "lib/sky_spot.glsl"

// One thread per leaf of a window and word of spots: which bright spots of the environment it sees past the surfaces that
// the bins around their directions name.                                                           [Dong2007 4.4]
// reads winners[6 n n * leaf_count of the window], receivers, leaf_elements, spots[spot_count], walk_texels,
// walk_starts[node_count], leaf_cells, corner_texels
// writes spots_seen[element_count * ceil(spot_count / 32)] (bits)   shared none
// Differs from [Dong2007]: there an empty bin sees the environment, so that a sun casts a shadow as wide as a bin.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Winners { uint winners[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Receivers { Receiver receivers[]; };
layout(set = 0, binding = 2, scalar) readonly buffer LeafElements { uint leaf_elements[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Spots { SkySpot spots[]; };
layout(set = 0, binding = 4) uniform usamplerBuffer walk_texels;
layout(set = 0, binding = 5, scalar) readonly buffer WalkStarts { uint walk_starts[]; };
layout(set = 0, binding = 6, scalar) readonly buffer LeafCells { LeafCell leaf_cells[]; };
layout(set = 0, binding = 7) uniform usamplerBuffer corner_texels;
layout(set = 0, binding = 8, scalar) writeonly buffer SpotsSeen { uint spots_seen[]; };
layout(push_constant, scalar) uniform Params {
    uint first_leaf;
    uint leaf_count;    // of the window
    uint n;
    uint spot_count;
    uint all_leaves;
    float far;          // m, beyond all there is
} params;

#include "methods/implicit_visibility/hidden.glsl"

// From two levels above a winner so many times two levels further up: the rim of a thing that a direction passes may belong
// to another part of it than what the bins name, and there is no emitter whose bins would tell.
const uint CLIMBS = 3;

bool is_visible(uint local, Receiver at, vec3 direction)
{
    CellBetween cell = cell_between(turn_back(at.frame, direction), params.n);
    vec3 way = params.far * direction;
    uvec4 starts = uvec4(EMPTY_BIN);
    for (uint corner = 0; corner < 4; ++corner) {
        uint winner = winners[bin_around(cell, corner, params.n) * params.leaf_count + local];
        uint start = start_below(winner);
        for (uint k = 0; k < CLIMBS && start != EMPTY_BIN; ++k)
            start = walk_starts[texelFetch(walk_texels, int(WALK_TEXELS * start + 2)).x];
        starts[corner] = start_near(start, at.origin, way, vec3(0.0));
    }
    return !is_any_met(starts, at.origin, way);
}

void main()
{
    uint words = (params.spot_count + 31) / 32;
    uint i = linear_index();
    if (i >= params.leaf_count * words) return;
    uint local = i % params.leaf_count, word = i / params.leaf_count;
    Receiver at = receivers[params.first_leaf + local];
    uint bits = 0;
    for (uint k = 0; k < 32 && word * 32 + k < params.spot_count; ++k) {
        vec3 direction = spots[word * 32 + k].direction;
        if (dot(direction, at.normal) > 0.0 && is_visible(local, at, direction)) bits |= 1u << k;
    }
    spots_seen[leaf_elements[params.first_leaf + local] * words + word] = bits;
}
