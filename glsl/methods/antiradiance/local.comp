#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/direction_bins.glsl"
#include "lib/hierarchy.glsl"

// Eight threads per leaf: incident radiance becomes irradiance of both sides, reflected radiance, and antiradiance, which
// goes on where the light came from, negated.                                       [Dachsbacher2007 4.2 local pass, Eqs. 18, 19]
// reads leaves, nodes, cosine_norms, bin_directions, incident[node_count * BIN_COUNT] (pushed down to
//       the parents of leaves), environment[BIN_COUNT] (W m^-2 sr^-1),
//       source[2 leaf_count] (radiosity that needs no transport, W/m2, front and back), albedo[element_count],
//       glossy_of_leaf[leaf_count], specular[glossy_count * BIN_COUNT] (W m^-2 sr^-1)
// updates radiosity[2 leaf_count] (W/m2), means[2 leaf_count] (W m^-2 sr^-1), peaks[leaf_count * BIN_COUNT] (of the mean),
//         exitant (rows of leaves; intensity per area, W m^-2 sr^-1)
// writes irradiance[2 leaf_count] (W/m2), residuals[leaf_count] (W: how much the exitant light changed, how much there is,
//        how much of it is reflected and emitted)
// shared 64 x (irradiance of both sides, residuals)
// Differs from [Dachsbacher2007]: what arrives in a bin may not fall far below zero. While antiradiance settles, each step
// takes away too much, then too little; without a floor the difference first grows with the number of surfaces one behind
// the other (books on a shelf: a thousandfold). One leaf is both sides of a surface; open surfaces take away light from behind as well.
layout(local_size_x = 64) in;
layout(constant_id = 0) const uint WORDS = 2;    // of 64 bits an entry of the tables: 2 (f32) or 1 (f16)
layout(constant_id = 1) const uint BIN_COUNT = 128;
layout(set = 0, binding = 0, scalar) readonly buffer Leaves { HierarchyLeaf leaves[]; };
layout(set = 0, binding = 1, scalar) readonly buffer CosineNorms { float cosine_norms[]; };
layout(set = 0, binding = 2, scalar) readonly buffer BinDirections { vec3 bin_directions[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Incident { uint64_t incident[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Environment { vec3 environment[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Source { vec3 source[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Albedo { vec3 albedo[]; };
layout(set = 0, binding = 7, scalar) buffer Radiosity { vec3 radiosity[]; };
layout(set = 0, binding = 8, scalar) buffer Exitant { uint64_t exitant[]; };
layout(set = 0, binding = 9, scalar) writeonly buffer Irradiance { vec3 irradiance[]; };
layout(set = 0, binding = 10, scalar) writeonly buffer Residuals { vec3 residuals[]; };
layout(set = 0, binding = 11, scalar) readonly buffer Nodes { HierarchyNode nodes[]; };
layout(set = 0, binding = 12, scalar) buffer Means { vec3 means[]; };
layout(set = 0, binding = 13, scalar) readonly buffer GlossyOfLeaf { uint glossy_of_leaf[]; };
layout(set = 0, binding = 14, scalar) readonly buffer Specular { vec3 specular[]; };
layout(set = 0, binding = 15, scalar) buffer Peaks { float peaks[]; };
layout(push_constant, scalar) uniform Params {
    uint leaf_count;
    uint update_radiosity;      // 0: reflected light stays as it is, antiradiance alone goes on
    uint sets_floor;            // 1: what arrives now, uncut, sets how far below zero later light may fall
    float undershoot;           // see floor.glsl
    float damping;              // share of the new exitant light; the rest stays as it was
    uint add_environment;       // 1: the environment shines on every leaf, as if nothing were in the way
} params;

#include "methods/antiradiance/floor.glsl"
#include "methods/antiradiance/table.glsl"

const float PI = 3.14159265358979;
const uint LANES = 8;       // threads of a leaf
shared vec3 sh_front[64], sh_back[64];
shared vec2 sh_residual[64];

// What the leaf received itself and what its ancestors did, which stands with its parent.
vec3 incident_in(uint row, uint parent_row, uint bin)
{
    vec3 arriving = LOAD_ENTRY(incident, row + bin);
    if (parent_row != NONE) arriving += LOAD_ENTRY(incident, parent_row + bin);
    if (params.add_environment != 0) arriving += environment[bin];
    return arriving;
}

// What a bin holds before anything was taken away, of its side's mean.
void set_peak(uint at, vec3 arriving, vec3 mean)
{
    vec3 share = mix(vec3(0.0), arriving / max(mean, vec3(1e-30)), greaterThan(mean, vec3(0.0)));
    peaks[at] = max(peaks[at], max(share.r, max(share.g, share.b)));
}

void main()
{
    // A thread beyond the last leaf works on the last one, so that all meet at the barriers, and writes nothing.
    uint thread = gl_LocalInvocationID.x, lane = thread % LANES, first_lane = thread - lane;
    uint wanted = linear_index() / LANES, leaf = min(wanted, params.leaf_count - 1);
    bool is_own = wanted < params.leaf_count;
    HierarchyLeaf own = leaves[leaf];
    uint parent = nodes[own.node].parent;
    uint row = own.node * BIN_COUNT, parent_row = parent == NONE ? NONE : parent * BIN_COUNT;
    bool blocks_behind = (own.flags & BLOCKS_BEHIND) != 0, reflects_behind = (own.flags & REFLECTS_BEHIND) != 0;
    uint glossy = glossy_of_leaf[leaf];
    float norm = cosine_norms[leaf], bin_solid_angle = 4.0 * PI / float(BIN_COUNT);

    // What travels against the normal arrives at the front.
    vec3 front = vec3(0.0), back = vec3(0.0);
    for (uint bin = lane; bin < BIN_COUNT; bin += LANES) {
        float cosine = dot(own.normal, bin_directions[bin]);
        vec3 arriving = incident_in(row, parent_row, bin);
        if (params.sets_floor == 0) arriving = max(arriving, lowest_in(leaf, cosine <= 0.0 ? 0 : 1, bin, params.undershoot));
        arriving *= discrete_cosine(cosine, norm, BIN_COUNT) * bin_solid_angle;
        if (cosine <= 0.0) front += arriving;
        else back += arriving;
    }
    sh_front[thread] = front;
    sh_back[thread] = back;
    barrier();
    front = vec3(0.0);
    back = vec3(0.0);
    for (uint k = 0; k < LANES; ++k) {
        front += sh_front[first_lane + k];
        back += sh_back[first_lane + k];
    }
    vec3 mean_front = max(means[2 * leaf], front / PI), mean_back = max(means[2 * leaf + 1], back / PI);
    if (!reflects_behind) back = vec3(0.0);

    vec3 b_front = radiosity[2 * leaf], b_back = radiosity[2 * leaf + 1];
    if (params.update_radiosity != 0) {
        b_front = source[2 * leaf] + albedo[own.element] * front;
        b_back = source[2 * leaf + 1] + (reflects_behind ? albedo[own.back_element] * back : vec3(0.0));
    }

    vec2 residual = vec2(0.0);      // change, sum
    for (uint bin = lane; bin < BIN_COUNT; bin += LANES) {
        float cosine = dot(own.normal, bin_directions[bin]);
        bool leaves_front = cosine > 0.0;
        vec3 radiance = (leaves_front ? b_front : b_back) / PI;
        if (glossy != NONE) radiance += specular[glossy * BIN_COUNT + bin];
        if (!leaves_front || blocks_behind) {
            vec3 arriving = incident_in(row, parent_row, bin);
            if (params.sets_floor != 0) {
                if (is_own) set_peak(leaf * BIN_COUNT + bin, arriving, leaves_front ? mean_back : mean_front);
            } else {
                 arriving = max(arriving, lowest_in(leaf, leaves_front ? 1 : 0, bin, params.undershoot));
            }
            radiance -= arriving;
        }
        vec3 before = LOAD_ENTRY(exitant, row + bin);
        vec3 intensity = mix(before, discrete_cosine(cosine, norm, BIN_COUNT) * radiance, params.damping);
        vec3 change = abs(intensity - before);
        residual += vec2(change.r + change.g + change.b, abs(intensity.r) + abs(intensity.g) + abs(intensity.b));
        if (is_own) STORE_ENTRY(exitant, row + bin, intensity);
    }
    sh_residual[thread] = residual;
    barrier();
    if (lane != 0 || !is_own) return;
    residual = vec2(0.0);
    for (uint k = 0; k < LANES; ++k) residual += sh_residual[first_lane + k];
    if (params.sets_floor != 0) {
        means[2 * leaf] = mean_front;
        means[2 * leaf + 1] = mean_back;
    }
    irradiance[2 * leaf] = front;
    irradiance[2 * leaf + 1] = back;
    radiosity[2 * leaf] = b_front;
    radiosity[2 * leaf + 1] = b_back;
    vec3 sent = b_front + b_back;
    residuals[leaf] = own.area * vec3(bin_solid_angle * residual, sent.r + sent.g + sent.b);
}
