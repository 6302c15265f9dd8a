#version 460
#include "lib/prelude.glsl"
#include "lib/pair_queue.glsl"
#include "methods/face_cluster/make_element.glsl"

// One thread per pair of the step: makes the children of what is to be split and has none. Their irradiance and unshot
// light are the parent's, by change of basis: a vector only where it lies in the child's half-space, unshot light in
// proportion to what the child reflects (or emits).                                            [Gobbetti2003 3.3.4]
// reads counters, taken_pairs, decisions   updates elements, pool, unshot, next_unshot, direct, indirect, arriving
// writes element_nodes   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 10, scalar) readonly buffer Counters { PairCounters counters[]; };
layout(set = 0, binding = 11, scalar) readonly buffer Taken { uvec2 taken_pairs[]; };
layout(set = 0, binding = 12, scalar) readonly buffer Decisions { uint decisions[]; };
layout(set = 0, binding = 13, scalar) buffer Unshot { vec3 unshot[]; };             // per element and function, W/m2
layout(set = 0, binding = 14, scalar) buffer NextUnshot { vec3 next_unshot[]; };
layout(set = 0, binding = 15, scalar) buffer Direct { mat3 direct_irradiance[]; };  // per element and function; a column a channel
layout(set = 0, binding = 16, scalar) buffer Indirect { mat3 indirect_irradiance[]; };
layout(set = 0, binding = 17, scalar) writeonly buffer Arriving { int arriving[]; };
layout(constant_id = 1) const uint IRRADIANCE_FUNCTIONS = 3u;
layout(constant_id = 2) const uint RADIOSITY_FUNCTIONS = 1u;
layout(push_constant, scalar) uniform Params {
    uint capacity;      // elements
    uint is_emission;   // unshot light is emission
} params;

// Share of the parent's light per channel that the child sends: their albedos' ratio.
vec3 share_of(vec3 child, vec3 parent) { return mix(child / max(parent, vec3(1e-30)), vec3(1.0), lessThanEqual(parent, vec3(0.0))); }

void inherit(uint child, uint parent)
{
    FaceElement c = elements[child], p = elements[parent];
    mat3 directs[MOST_FUNCTIONS], indirects[MOST_FUNCTIONS];
    vec3 unshots[MOST_FUNCTIONS], nexts[MOST_FUNCTIONS];
    for (uint k = 0; k < IRRADIANCE_FUNCTIONS; ++k) directs[k] = indirects[k] = mat3(0.0);
    for (uint k = 0; k < RADIOSITY_FUNCTIONS; ++k) unshots[k] = nexts[k] = vec3(0.0);
    for (uint g = 0; g < 16; ++g) {
        vec2 uv = gauss_point(g), above = plane_coordinates(p, plane_point(c, uv));
        mat3 d = mat3(0.0), i = mat3(0.0);
        vec3 u = vec3(0.0), n = vec3(0.0);
        for (uint k = 0; k < IRRADIANCE_FUNCTIONS; ++k) {
            float b = basis(k, above);
            d += b * direct_irradiance[parent * IRRADIANCE_FUNCTIONS + k];
            i += b * indirect_irradiance[parent * IRRADIANCE_FUNCTIONS + k];
            if (k < RADIOSITY_FUNCTIONS) {
                u += b * unshot[parent * RADIOSITY_FUNCTIONS + k];
                n += b * next_unshot[parent * RADIOSITY_FUNCTIONS + k];
            }
        }
        for (uint k = 0; k < IRRADIANCE_FUNCTIONS; ++k) {
            float b = basis(k, uv) * gauss_weight(g);
            directs[k] += b * d;
            indirects[k] += b * i;
            if (k < RADIOSITY_FUNCTIONS) {
                unshots[k] += b * u;
                nexts[k] += b * n;
            }
        }
    }
    vec3 keeps_direct = vec3(greaterThan(c.axis_z * directs[0], vec3(0.0)));
    vec3 keeps_indirect = vec3(greaterThan(c.axis_z * indirects[0], vec3(0.0)));
    for (uint k = 0; k < IRRADIANCE_FUNCTIONS; ++k) {
        for (uint channel = 0; channel < 3; ++channel) {
            directs[k][channel] *= keeps_direct[channel];
            indirects[k][channel] *= keeps_indirect[channel];
        }
        direct_irradiance[child * IRRADIANCE_FUNCTIONS + k] = directs[k];
        indirect_irradiance[child * IRRADIANCE_FUNCTIONS + k] = indirects[k];
        for (uint w = 0; w < 9; ++w) arriving[(child * IRRADIANCE_FUNCTIONS + k) * 9 + w] = 0;
    }
    vec3 share = share_of(c.albedo, p.albedo);
    for (uint k = 0; k < RADIOSITY_FUNCTIONS; ++k) {
        vec3 emitted = k == 0 ? PI * c.emission : vec3(0.0);
        unshot[child * RADIOSITY_FUNCTIONS + k] = params.is_emission != 0 ? emitted : share * unshots[k];
        next_unshot[child * RADIOSITY_FUNCTIONS + k] = share * nexts[k];
    }
}

void split(uint index)
{
    if (elements[index].children != NO_FACE_ELEMENT) return;
    // Whoever is first makes them; the claim is replaced by the place before any other kernel reads it.
    if (atomicCompSwap(elements[index].children, NO_FACE_ELEMENT, NO_FACE_ELEMENT - 1) != NO_FACE_ELEMENT) return;
    uint first = atomicAdd(pool[0].element_count, 2);
    if (first + 2 > params.capacity) {
        pool[0].is_full = 1;
        elements[index].children = NO_FACE_ELEMENT;
        return;
    }
    uint left = elements[index].cluster + 1;
    uint level = elements[index].level + 1;
    for (uint k = 0; k < 2; ++k) {
        make_element(first + k, elements[index].instance, k == 0 ? left : cluster_skips[left], index, level);
        inherit(first + k, index);
    }
    elements[index].children = first;
}

void main()
{
    uint i = linear_index();
    if (i >= counters[0].taken) return;
    uint decision = decisions[i];
    if (decision == PAIR_IS_DONE) return;
    split(decision == SPLIT_SHOOTER ? taken_pairs[i].y : taken_pairs[i].x);
}
