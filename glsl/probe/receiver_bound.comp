#version 460
#include "lib/prelude.glsl"
#include "lib/random.glsl"
#include "lib/receiver.glsl"

// One thread per case: the oracle's bound for a leaf as a node, and the most that points of the leaf send, for tests.
// reads cases[case_count]   writes results[case_count]   shared none
struct BoundCase {
    vec3 normal;        // of the receiver at the origin, unit
    vec3 to_eye;        // unit
    vec3 albedo;
    vec3 f0;
    float f90;
    float alpha;
    SenderLeaf leaf;
    float radius;       // of a sphere about its centre that holds it, metres
};
struct BoundResult {
    float bound;        // W m^-2 sr^-1, for a power of pi
    float largest;
};
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Cases { BoundCase cases[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Results { BoundResult results[]; };
layout(push_constant, scalar) uniform Params { uint case_count; uint point_count; } params;

void main()
{
    uint i = linear_index();
    if (i >= params.case_count) return;

    BoundCase c = cases[i];
    Surface surface = Surface(c.albedo, c.f0, c.f90, c.alpha, vec3(0.0), c.normal, true);
    Receiver receiver = Receiver(vec3(0.0), c.normal, c.to_eye, surface);
    vec3 normal = leaf_normal(c.leaf);
    results[i].bound = largest_radiance(SenderNode(c.leaf.centre, c.radius, normal, 1.0, 1, PI), receiver);

    float largest = 0.0;
    for (uint k = 0; k < params.point_count; ++k) {
        vec3 at = leaf_point(c.leaf, unit_interval(even_point(k, uvec4(i, 1u, 2u, 0u))));
        float squared = dot(at, at);
        vec3 to_light = at / sqrt(squared);
        float cosines = max(dot(c.normal, to_light), 0.0) * max(-dot(normal, to_light), 0.0);
        vec3 reflected = brdf_value(surface, c.to_eye, to_light) * (cosines / squared);
        largest = max(largest, max(reflected.r, max(reflected.g, reflected.b)));
    }
    results[i].largest = largest;
}
