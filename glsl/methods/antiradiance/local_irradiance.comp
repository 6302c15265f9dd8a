#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/direction_bins.glsl"
#include "lib/hierarchy.glsl"

// One thread per leaf and few pairs of bins: irradiance of both sides; and what arrives at fronts leaves backs that reflect nothing as
// antiradiance, here, where it is at hand: these passes wait for memory.          [Dachsbacher2007 4.2 local pass, Eq. 19]
// reads leaves, nodes, cosine_norms, bin_directions, incident[window's bins * node_count] (pushed down to the parents of leaves),
//       environment[BIN_COUNT] (W m^-2 sr^-1), means[2 leaf_count] (W m^-2 sr^-1), peaks[BIN_COUNT * leaf_count] (of the mean)
// updates exitant (of leaves; intensity per area, W m^-2 sr^-1)
// writes parts[part_count * 2 * leaf_count] (W/m2, fronts and backs of some pairs one after the other),
//        residual_parts[part_count * leaf_count] (W: how much the exitant light changed, how much there is)
// shared none
layout(local_size_x = 64) in;
layout(constant_id = 0) const uint WORDS = 2;    // of 64 bits an entry of the tables: 2 (f32) or 1 (f16)
layout(constant_id = 1) const uint BIN_COUNT = 128;
layout(set = 0, binding = 0, scalar) readonly buffer Leaves { HierarchyLeaf leaves[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Nodes { HierarchyNode nodes[]; };
layout(set = 0, binding = 2, scalar) readonly buffer CosineNorms { float cosine_norms[]; };
layout(set = 0, binding = 3, scalar) readonly buffer BinDirections { uint64_t bin_directions[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Incident { uint64_t incident[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Environment { vec3 environment[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Means { vec3 means[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Peaks { float peaks[]; };
layout(set = 0, binding = 8, scalar) writeonly buffer Parts { vec3 parts[]; };
layout(set = 0, binding = 9, scalar) buffer Exitant { uint64_t exitant[]; };
layout(set = 0, binding = 10, scalar) writeonly buffer ResidualParts { vec2 residual_parts[]; };
layout(push_constant, scalar) uniform Params {
    uint leaf_count;
    uint node_count;
    uint first_bin;             // of the window
    uint sets_floor;            // 1: what arrives now counts uncut, see floor.glsl; nothing is sent yet
    float undershoot;
    float damping;              // share of the new exitant light; the rest stays as it was
    uint add_environment;       // 1: the environment shines on every leaf, as if nothing were in the way
} params;

#include "methods/antiradiance/local.glsl"

// What arrives in a bin, not far below zero, times the cosine.
vec3 held_in(HierarchyLeaf own, uint leaf, uint parent, uint bin, vec3 mean, float held)
{
    vec3 arriving = arriving_in(own.node, parent, bin);
    if (params.sets_floor == 0) arriving = max(arriving, lowest_of(peaks[bin * params.leaf_count + leaf], mean, params.undershoot));
    return held * arriving;
}

void main()
{
    uint leaf = gl_GlobalInvocationID.x, part = part_of(gl_WorkGroupID.y);
    if (leaf >= params.leaf_count) return;
    HierarchyLeaf own = leaves[leaf];
    uint parent = nodes[own.node].parent;
    float norm = cosine_norms[leaf], bin_solid_angle = 4.0 * PI / float(BIN_COUNT);
    vec3 mean_front = means[2 * leaf];
    // What meets the back counts where it is reflected, and for the floor of what is taken away from it.
    bool needs_back = (own.flags & REFLECTS_BEHIND) != 0 || (params.sets_floor != 0 && (own.flags & BLOCKS_BEHIND) != 0);

    bool sends = params.sets_floor == 0 && (own.flags & REFLECTS_BEHIND) == 0;

    vec3 front = vec3(0.0), back = vec3(0.0);
    vec2 residual = vec2(0.0);      // change, sum
    for (uint pair = part * PAIRS_A_THREAD; pair < pairs_end(part); ++pair) {
        float cosine = dot(own.normal, BIN_DIRECTION(2 * pair)), held = discrete_cosine(cosine, norm, BIN_COUNT);
        uint bin = arriving_bin(pair, cosine);
        vec3 arriving = held_in(own, leaf, parent, bin, mean_front, held);
        front += arriving;
        if (sends) SEND(window_entry(own.node, bin), -arriving, residual)
        if (needs_back) back += held_in(own, leaf, parent, leaving_bin(pair, cosine), means[2 * leaf + 1], held);
    }
    residual_parts[part * params.leaf_count + leaf] = own.area * bin_solid_angle * residual;
    parts[2 * part * params.leaf_count + leaf] = bin_solid_angle * front;
    parts[(2 * part + 1) * params.leaf_count + leaf] = bin_solid_angle * back;
}
