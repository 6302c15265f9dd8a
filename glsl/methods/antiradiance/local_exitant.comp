#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/direction_bins.glsl"
#include "lib/hierarchy.glsl"

// One thread per leaf and few pairs of bins: reflected radiance, less antiradiance, which goes on where the light came from,
// negated; but for what local_irradiance has sent.                               [Dachsbacher2007 4.2 local pass, Eqs. 18, 19]
// reads leaves, nodes, cosine_norms, bin_directions, incident[window's bins * node_count] (pushed down to the parents of leaves),
//       environment[BIN_COUNT] (W m^-2 sr^-1), radiosity[2 leaf_count] (W/m2), means[2 leaf_count] (W m^-2 sr^-1),
//       glossy_of_leaf[leaf_count], specular[glossy_count * BIN_COUNT] (W m^-2 sr^-1)
// updates peaks[BIN_COUNT * leaf_count] (of the mean), exitant (of leaves; intensity per area, W m^-2 sr^-1)
//         residual_parts[part_count * leaf_count] (of leaves that are not plain; W: how much the exitant light changed, how much there is)
// shared none
// Differs from [Dachsbacher2007]: what arrives in a bin may not fall far below zero. While antiradiance settles, each step
// takes away too much, then too little; without a floor the difference first grows with the number of surfaces one behind
// the other (books on a shelf: a thousandfold). One leaf is both sides of a surface; open surfaces take away light from behind as well.
layout(local_size_x = 64) in;
layout(constant_id = 0) const uint WORDS = 2;    // of 64 bits an entry of the tables: 2 (f32) or 1 (f16)
layout(constant_id = 1) const uint BIN_COUNT = 128;
layout(set = 0, binding = 0, scalar) readonly buffer Leaves { HierarchyLeaf leaves[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Nodes { HierarchyNode nodes[]; };
layout(set = 0, binding = 2, scalar) readonly buffer CosineNorms { float cosine_norms[]; };
layout(set = 0, binding = 3, scalar) readonly buffer BinDirections { uint64_t bin_directions[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Incident { uint64_t incident[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Environment { vec3 environment[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Radiosity { vec3 radiosity[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Means { vec3 means[]; };
layout(set = 0, binding = 8, scalar) buffer Peaks { float peaks[]; };
layout(set = 0, binding = 9, scalar) readonly buffer GlossyOfLeaf { uint glossy_of_leaf[]; };
layout(set = 0, binding = 10, scalar) readonly buffer Specular { vec3 specular[]; };
layout(set = 0, binding = 11, scalar) buffer Exitant { uint64_t exitant[]; };
layout(set = 0, binding = 12, scalar) buffer ResidualParts { vec2 residual_parts[]; };
layout(push_constant, scalar) uniform Params {
    uint leaf_count;
    uint node_count;
    uint first_bin;             // of the window
    uint sets_floor;            // 1: what arrives now, uncut, sets how far below zero later light may fall
    float undershoot;           // see floor.glsl
    float damping;              // share of the new exitant light; the rest stays as it was
    uint keeps_light;           // 1: what is reflected and emitted is in the table already
    uint add_environment;       // 1: the environment shines on every leaf, as if nothing were in the way
    uint is_undamped;           // 1: plain leaves send what they reflect, see plain.glsl
} params;

#include "methods/antiradiance/local.glsl"
#include "methods/antiradiance/plain.glsl"

// What a bin holds before anything was taken away, of its side's mean.
void set_peak(uint at, vec3 arriving, vec3 mean)
{
    vec3 share = mix(vec3(0.0), arriving / max(mean, vec3(1e-30)), greaterThan(mean, vec3(0.0)));
    peaks[at] = max(peaks[at], max(share.r, max(share.g, share.b)));
}

void main()
{
    uint leaf = gl_GlobalInvocationID.x, part = part_of(gl_WorkGroupID.y);
    if (leaf >= params.leaf_count) return;
    uint flags = leaves[leaf].flags, glossy = glossy_of_leaf[leaf];
    bool plain = is_plain(flags, glossy);
    if (plain && params.keeps_light != 0) return;
    uint node = leaves[leaf].node;
    vec3 normal = leaves[leaf].normal, l_front = radiosity[2 * leaf] / PI;
    float norm = cosine_norms[leaf];
    if (plain) {
        for (uint pair = part * PAIRS_A_THREAD; pair < pairs_end(part); ++pair) {
            float cosine = dot(normal, BIN_DIRECTION(2 * pair));
            uint entry = window_entry(node, leaving_bin(pair, cosine));
            STORE_ENTRY(exitant, entry, discrete_cosine(cosine, norm, BIN_COUNT) * l_front);
        }
        return;
    }

    uint parent = nodes[node].parent;
    bool blocks_behind = (flags & BLOCKS_BEHIND) != 0;
    vec3 l_back = radiosity[2 * leaf + 1] / PI, mean_front = means[2 * leaf], mean_back = means[2 * leaf + 1];
    // What leaves the front, and the back too where local_irradiance has not sent it.
    uint sides = params.sets_floor == 0 && (flags & REFLECTS_BEHIND) == 0 ? 1 : 2;
    vec2 residual = vec2(0.0);      // change, sum
    for (uint pair = part * PAIRS_A_THREAD; pair < pairs_end(part); ++pair) {
        float cosine = dot(normal, BIN_DIRECTION(2 * pair)), held = discrete_cosine(cosine, norm, BIN_COUNT);
        for (uint side = 0; side < sides; ++side) {
            bool leaves_front = side == 0;
            uint bin = leaves_front ? leaving_bin(pair, cosine) : arriving_bin(pair, cosine);
            vec3 radiance = leaves_front ? l_front : l_back;
            if (glossy != NONE) radiance += specular[glossy * BIN_COUNT + bin];
            if (params.keeps_light != 0 && leaves_front && !blocks_behind) {
                vec3 size = abs(held * radiance);
                residual.y += size.r + size.g + size.b;
                continue;
            }
            if (!leaves_front || blocks_behind) {
                vec3 arriving = arriving_in(node, parent, bin), mean = leaves_front ? mean_back : mean_front;
                uint at = bin * params.leaf_count + leaf;
                if (params.sets_floor != 0) set_peak(at, arriving, mean);
                else arriving = max(arriving, lowest_of(peaks[at], mean, params.undershoot));
                radiance -= arriving;
            }
            SEND(window_entry(node, bin), held * radiance, residual)
        }
    }
    residual_parts[part * params.leaf_count + leaf] += leaves[leaf].area * (4.0 * PI / float(BIN_COUNT)) * residual;
}
