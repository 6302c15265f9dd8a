#version 460
#include "lib/prelude.glsl"
#include "lib/cluster_basis.glsl"
#include "lib/face_element.glsl"
#include "lib/pair_queue.glsl"

// A thread per pair of the step, for all elements claimed in it: their irradiance and unshot light are their parent's,
// by change of basis: a vector only where it lies in the child's half-space, unshot light in proportion to what the
// child reflects (or emits).                                                                   [Gobbetti2003 3.3.4]
// reads counters, elements, pool   updates unshot, next_unshot, direct, indirect   writes arriving   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Counters { PairCounters counters[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Elements { FaceElement elements[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Pool { PoolCounters pool[]; };
layout(set = 0, binding = 3, scalar) buffer Unshot { vec3 unshot[]; };             // per element and function, W/m2
layout(set = 0, binding = 4, scalar) buffer NextUnshot { vec3 next_unshot[]; };
layout(set = 0, binding = 5, scalar) buffer Direct { mat3 direct_irradiance[]; };  // per element and function; a column a channel
layout(set = 0, binding = 6, scalar) buffer Indirect { mat3 indirect_irradiance[]; };
layout(set = 0, binding = 7, scalar) writeonly buffer Arriving { int arriving[]; };
layout(constant_id = 0) const uint IRRADIANCE_FUNCTIONS = 3u;
layout(constant_id = 1) const uint RADIOSITY_FUNCTIONS = 1u;
layout(push_constant, scalar) uniform Params {
    uint capacity;      // elements
    uint is_emission;   // unshot light is emission
} params;

// Share of the parent's light per channel that the child sends: their albedos' ratio.
vec3 share_of(vec3 child, vec3 parent) { return mix(child / max(parent, vec3(1e-30)), vec3(1.0), lessThanEqual(parent, vec3(0.0))); }

mat3 kept(mat3 pushed, mat3 constant, vec3 normal)
{
    vec3 along = normal * constant;
    for (uint c = 0; c < 3; ++c)
        if (along[c] <= 0.0) pushed[c] = vec3(0.0);
    return pushed;
}

void inherit(uint child, uint k)
{
    FaceElement c = elements[child];
    uint parent = c.parent;
    FaceElement p = elements[parent];
    mat3 direct = mat3(0.0), constant_direct = mat3(0.0), indirect = mat3(0.0), constant_indirect = mat3(0.0);
    vec3 shoots = vec3(0.0), shoots_next = vec3(0.0);
    [[dont_unroll]] for (uint g = 0; g < 16; ++g) {
        vec2 uv = gauss_point(g), above = plane_coordinates(p, plane_point(c, uv));
        float own = basis(k, uv) * gauss_weight(g);
        [[dont_unroll]] for (uint j = 0; j < IRRADIANCE_FUNCTIONS; ++j) {
            float b = basis(j, above);
            mat3 d = b * direct_irradiance[parent * IRRADIANCE_FUNCTIONS + j], i = b * indirect_irradiance[parent * IRRADIANCE_FUNCTIONS + j];
            direct += own * d;
            constant_direct += gauss_weight(g) * d;
            indirect += own * i;
            constant_indirect += gauss_weight(g) * i;
            if (j >= RADIOSITY_FUNCTIONS) continue;
            shoots += own * b * unshot[parent * RADIOSITY_FUNCTIONS + j];
            shoots_next += own * b * next_unshot[parent * RADIOSITY_FUNCTIONS + j];
        }
    }
    uint at = child * IRRADIANCE_FUNCTIONS + k;
    direct_irradiance[at] = kept(direct, constant_direct, c.axis_z);
    indirect_irradiance[at] = kept(indirect, constant_indirect, c.axis_z);
    for (uint w = 0; w < 9; ++w) arriving[at * 9 + w] = 0;
    if (k >= RADIOSITY_FUNCTIONS) return;
    // As much power as the parent's, whatever parts of it and of its children were found to be hidden.
    float children_area = elements[p.children].area + elements[p.children + 1].area;
    vec3 share = min(p.area / max(children_area, 1e-30), 2.0) * share_of(c.albedo, p.albedo);
    vec3 emitted = k == 0 ? PI * c.emission : vec3(0.0);
    unshot[child * RADIOSITY_FUNCTIONS + k] = params.is_emission != 0 ? emitted : share * shoots;
    next_unshot[child * RADIOSITY_FUNCTIONS + k] = share * shoots_next;
}

void main()
{
    uint i = linear_index();
    if (i >= counters[0].taken) return;
    uint end = min(pool[0].element_count, params.capacity);
    uint work = (end - min(end, pool[0].made_count)) * IRRADIANCE_FUNCTIONS;
    [[dont_unroll]] for (uint w = i; w < work; w += counters[0].taken)
        inherit(pool[0].made_count + w / IRRADIANCE_FUNCTIONS, w % IRRADIANCE_FUNCTIONS);
}
