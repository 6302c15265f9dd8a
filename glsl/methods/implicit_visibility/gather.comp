#version 460
#include "lib/prelude.glsl"
#include "lib/bins.glsl"
#include "lib/quadtree.glsl"

// One thread per leaf of a window: irradiance from the winners of its bins.                        [Dong2007 4.3, Eq. 5]
// reads winners[6 n n * leaf_count of the window], receivers, leaf_elements, bin_vectors[6 n n] (sr: the integral of
// the unit direction over the bin), surfels, node_radiosity [node_count] (W/m2), glossy_of_node, specular (W m^-2 sr^-1), light_bins (bits)
// writes irradiance[element_count] (W/m2)   shared none.  Differs from [Dong2007]: see TRANSPORT.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Winners { uint winners[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Receivers { Receiver receivers[]; };
layout(set = 0, binding = 2, scalar) readonly buffer LeafElements { uint leaf_elements[]; };
layout(set = 0, binding = 3, scalar) readonly buffer BinVectors { vec3 bin_vectors[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Surfels { Surfel surfels[]; };
layout(set = 0, binding = 5, scalar) readonly buffer NodeRadiosity { vec3 node_radiosity[]; };
layout(set = 0, binding = 6, scalar) readonly buffer GlossyOfNode { uint glossy_of_node[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Specular { vec3 specular[]; };
layout(set = 0, binding = 8, scalar) writeonly buffer Irradiance { vec3 irradiance[]; };
layout(set = 0, binding = 9, scalar) readonly buffer LightBins { uint light_bins[]; };
layout(push_constant, scalar) uniform Params {
    uint first_leaf;
    uint leaf_count;    // of the window
    uint bin_count;
} params;
// What a sender weighs. BY_BINS: it covers its bin, so its weight is the bin's own form factor, scaled so that all bins
// above the horizon together weigh pi; BY_BOUNDED_BINS: but it fills no more of the bin than its own solid angle; BY_DISCS:
// the paper's Eq. 5, a point to a disc.
layout(constant_id = 0) const uint TRANSPORT = 0;
const uint BY_BINS = 0;
const uint BY_BOUNDED_BINS = 1;
const uint BY_DISCS = 2;
// 1: light links alone.
layout(constant_id = 1) const uint OF_EMITTERS = 0;
// Of glossy nodes' tables; 0: all send evenly.
layout(constant_id = 2) const uint TABLE_SIDE = 0;

const float PI = 3.14159265358979;

// From the winner of a bin: radiosity times its weight, W/m2.
vec3 received(uint local, Receiver at, uint bin, vec3 vector, float weight)
{
    uint winner = winners[bin * params.leaf_count + local];
    bool is_link = OF_EMITTERS == 0 || (light_bins[bin / 32 * params.leaf_count + local] >> bin % 32 & 1) != 0;
    if (winner >= BACK_SEEN || !is_link) return vec3(0.0);
    vec3 sent = node_radiosity[winner];
    if (TRANSPORT != BY_BINS) {
        Surfel s = surfels[winner];
        vec3 offset = s.centre - at.origin;
        float squared = dot(offset, offset);
        float solid_angle = s.area * max(dot(s.normal, -offset), 0.0) / (squared * sqrt(squared));
        if (TRANSPORT == BY_DISCS) weight = solid_angle * max(dot(at.normal, offset), 0.0) / sqrt(squared);
        else weight *= min(1.0, solid_angle / length(vector));
    }
    if (TABLE_SIDE != 0 && glossy_of_node[winner] != EMPTY_BIN)
        sent += PI * specular[glossy_of_node[winner] * 6 * TABLE_SIDE * TABLE_SIDE + bin_of(-turn(at.frame, vector), TABLE_SIDE)];
    return weight * sent;
}

void main()
{
    uint local = linear_index();
    if (local >= params.leaf_count) return;
    Receiver at = receivers[params.first_leaf + local];
    vec3 normal = turn_back(at.frame, at.normal);
    vec3 sum = vec3(0.0);
    float total = 0.0;
    uint per_face = params.bin_count / 6;
    for (uint cell = 0; cell < per_face; ++cell) {
        vec3 in_axes = bin_vectors[FACE_OF_Z * per_face + cell];    // of all faces
        for (uint face = 0; face < 6; ++face) {
            vec3 vector = from_face(face, in_axes);
            float weight = max(dot(vector, normal), 0.0);
            total += weight;
            if (weight > 0.0) sum += received(local, at, face * per_face + cell, vector, weight);
        }
    }
    irradiance[leaf_elements[params.first_leaf + local]] = sum / (TRANSPORT == BY_DISCS ? PI : max(total, 1e-20));
}
