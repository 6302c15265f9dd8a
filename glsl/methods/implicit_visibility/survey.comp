#version 460
#include "lib/prelude.glsl"
#include "lib/bins.glsl"

// One thread per leaf of a window: how much of what it sees turns its back, in thousandths of the cosine-weighted
// hemisphere (an element that sees mostly backs stands inside something), how many links it kept, and the list of its
// light links, where anything emits along links: the bins whose winners do.                                                        [Dong2007 4.4]
// reads winners[6 n n * leaf_count of the window], receivers, leaf_elements, bin_vectors[6 n n] (sr), node_radiosity: emitted, [node_count]
// writes outcomes[element_count], light_bins[ceil(6 n n / 32) * leaf_count of the window] (bits)   updates link_counts
// shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Winners { uint winners[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Receivers { Receiver receivers[]; };
layout(set = 0, binding = 2, scalar) readonly buffer LeafElements { uint leaf_elements[]; };
layout(set = 0, binding = 3, scalar) readonly buffer BinVectors { vec3 bin_vectors[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer Outcomes { uint outcomes[]; };
layout(set = 0, binding = 5, scalar) buffer Counts { LinkCounts link_counts[]; };
layout(set = 0, binding = 6, scalar) readonly buffer NodeRadiosity { vec3 node_radiosity[]; };
layout(set = 0, binding = 7, scalar) writeonly buffer LightBins { uint light_bins[]; };
layout(push_constant, scalar) uniform Params { uint first_leaf; uint leaf_count; uint bin_count; uint has_emitters; } params;

void main()
{
    uint local = linear_index();
    if (local >= params.leaf_count) return;
    Receiver at = receivers[params.first_leaf + local];
    vec3 normal = turn_back(at.frame, at.normal);
    float backs = 0.0, total = 0.0;
    uint kept = 0, per_face = params.bin_count / 6;
    for (uint cell = 0; cell < per_face; ++cell) {
        vec3 in_axes = bin_vectors[FACE_OF_Z * per_face + cell];    // of all faces
        for (uint face = 0; face < 6; ++face) {
            float weight = max(dot(from_face(face, in_axes), normal), 0.0);
            total += weight;
            if (weight <= 0.0) continue;
            uint winner = winners[(face * per_face + cell) * params.leaf_count + local];
            kept += winner != EMPTY_BIN ? 1 : 0;
            backs += winner != EMPTY_BIN && (winner & BACK_SEEN) != 0 ? weight : 0.0;
        }
    }
    uint lights = 0;
    for (uint bin = 0; bin < params.bin_count && params.has_emitters != 0; ++bin) {
        uint winner = winners[bin * params.leaf_count + local];
        bool is_light = dot(bin_vectors[bin], normal) > 0.0 && winner < BACK_SEEN && node_radiosity[winner] != vec3(0.0);
        lights |= is_light ? 1u << bin % 32 : 0u;
        if (bin % 32 == 31 || bin + 1 == params.bin_count) {
            light_bins[bin / 32 * params.leaf_count + local] = lights;
            lights = 0;
        }
    }
    atomicAdd(link_counts[0].kept, kept);
    outcomes[leaf_elements[params.first_leaf + local]] = uint(1000.0 * backs / max(total, 1e-20));
}
