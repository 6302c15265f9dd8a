#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/direction_bins.glsl"
#include "lib/hierarchy.glsl"
#include "lib/leaf_gloss.glsl"
#include "lib/specular_albedo.glsl"

// One thread per (glossy leaf, few bins): radiance that its specular lobe sends along those bins: what `glossy_radiance` (in
// to_eye.comp) sums for one direction.                                              [Dachsbacher2007 4.2 local pass, Eq. 18]
// reads glossy_leaves[glossy_count], leaves, gloss, cosine_norms, bin_directions, arrived[glossy_count * BIN_COUNT] (W m^-2 sr^-1),
// base[glossy_count * BIN_COUNT] (what is sent in any case)   writes specular[glossy_count * BIN_COUNT] (W m^-2 sr^-1)   shared none
layout(local_size_x = 64) in;
layout(constant_id = 0) const uint WORDS = 2;    // of 64 bits an entry of the tables: 2 (f32) or 1 (f16)
layout(constant_id = 1) const uint BIN_COUNT = 128;
layout(set = 0, binding = 0, scalar) readonly buffer GlossyLeaves { uint glossy_leaves[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Leaves { HierarchyLeaf leaves[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Gloss { LeafGloss gloss[]; };
layout(set = 0, binding = 3, scalar) readonly buffer CosineNorms { float cosine_norms[]; };
layout(set = 0, binding = 4, scalar) readonly buffer BinDirections { uint64_t bin_directions[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Arrived { uint64_t arrived[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Base { vec3 base[]; };
layout(set = 0, binding = 7, scalar) writeonly buffer Specular { vec3 specular[]; };
layout(push_constant, scalar) uniform Params { uint glossy_count; } params;

#include "methods/antiradiance/glossy_surface.glsl"
#include "methods/antiradiance/table.glsl"

// Bins of a thread: each direction that light comes from, and what comes, is loaded once for all. First those that look up,
// then their opposites: together they mostly lie on one side of a surface.
const uint SENT_BINS = 8;
uint sent_bin(uint index) { return index < BIN_COUNT / 2 ? 2 * index : 2 * index - BIN_COUNT + 1; }

// A direction that light is sent along, and what is summed up for it.
struct Sent {
    vec3 along;             // the surface: part of the direction
    float cosine, root;     // to the normal, and Smith's root of it
    float side;             // of the surface: 1 front, -1 back
    vec3 even, steep;       // radiance by the lobe's weight, and by that times (1 - cos)^5 of Schlick's term
    vec2 weights;
};

void main()
{
    const uint groups = BIN_COUNT / SENT_BINS;
    uint i = linear_index();
    if (i >= params.glossy_count * groups) return;
    uint glossy = i / groups, leaf = glossy_leaves[glossy], first = i % groups * SENT_BINS;
    vec3 normal = leaves[leaf].normal;
    float norm = cosine_norms[leaf];
    Surface s = glossy_surface(gloss[leaf], normal);
    float a = s.alpha * s.alpha;
    uint sides = (leaves[leaf].flags & REFLECTS_BEHIND) != 0 ? 2 : 1;

    Sent sent[SENT_BINS];
    [[unroll]] for (uint k = 0; k < SENT_BINS; ++k) {
        vec3 w = BIN_DIRECTION(sent_bin(first + k));
        float cosine = dot(normal, w);
        sent[k] = Sent(w - cosine * normal, max(abs(cosine), 1e-6), smith_root(max(abs(cosine), 1e-6), s.alpha),
                       cosine > 0.0 ? 1.0 : -1.0, vec3(0.0), vec3(0.0), vec2(0.0));
    }
    bool any_sent = sides == 2;
    [[unroll]] for (uint k = 0; k < SENT_BINS; ++k) any_sent = any_sent || sent[k].side > 0.0;
    for (uint pair = 0; any_sent && pair < BIN_COUNT / 2; ++pair) {
        vec3 w = BIN_DIRECTION(2 * pair);
        for (uint side = 0; side < sides; ++side) {
            // Towards where the light comes from: to the front's side of the surface, then to the back's.
            bool is_front = side == 0, is_opposite = dot(normal, w) > 0.0 == is_front;
            vec3 to_light = is_opposite ? w : -w;
            uint bin = 2 * pair + (is_opposite ? 1 : 0);
            vec3 arriving = LOAD_ENTRY(arrived, glossy * BIN_COUNT + bin);
            float signed_cosine = dot(normal, to_light), cosine = abs(signed_cosine), root = smith_root(cosine, s.alpha);
            float held = discrete_cosine(cosine, norm, BIN_COUNT) * (0.5 * a / PI);
            vec3 along = to_light - signed_cosine * normal;
            [[unroll]] for (uint k = 0; k < SENT_BINS; ++k) {
                // brdf_value without its colour, by the sum of both directions in place of the half vector.
                vec3 tangent = sent[k].along + along;
                float height = sent[k].cosine + cosine, low = dot(tangent, tangent), high = height * height, squared = low + high;
                float d = low + a * high;
                float weight = held * squared * squared / (d * d * (cosine * sent[k].root + sent[k].cosine * root));
                weight = sent[k].side > 0.0 == is_front && squared > 1e-12 ? weight : 0.0;
                float m = clamp(1.0 - 0.5 * sqrt(squared), 0.0, 1.0), steep = m * m * m * m * m * weight;
                sent[k].even += weight * arriving;
                sent[k].steep += steep * arriving;
                sent[k].weights += vec2(weight, steep);
            }
        }
    }
    [[unroll]] for (uint k = 0; k < SENT_BINS; ++k) {
        vec3 rise = vec3(s.f90) - s.f0;
        vec3 within = (s.f0 * sent[k].even + rise * sent[k].steep) / max(s.f0 * sent[k].weights.x + rise * sent[k].weights.y, vec3(1e-20));
        vec3 value = max(specular_albedo(s, sent[k].cosine) * within, vec3(0.0));
        uint at = glossy * BIN_COUNT + sent_bin(first + k);
        specular[at] = base[at] + value;
    }
}
