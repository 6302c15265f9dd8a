#ifndef FACE_CLUSTER_WAYS
#define FACE_CLUSTER_WAYS
// What of the ways between two elements is free, as rays between their nodes say. Included after receive.
#include "lib/random.glsl"

// Draws a node of `other`, of `count` from `first` on, for a way from node `r` of `element`: by what faces there would pass
// between them. Returns the sum of that over all, which is 0 where none faces another.
float drawn(uint element, uint r, uint other, uint first, uint count, float chance, out uint node)
{
    vec3 x = receiver_node(element, r), normal = node_normal(element, r);
    float sums[RULE_NODES], sum = 0.0;
    [[dont_unroll]] for (uint e = 0; e < count; ++e) {
        vec3 d = receiver_node(other, first + e) - x;
        float squared = max(dot(d, d), 1e-20);
        sum += max(dot(d, normal), 0.0) * max(-dot(d, node_normal(other, first + e)), 0.0) / (squared * squared);
        sums[e] = sum;
    }
    uint e = 0;
    while (e + 1 < count && sums[e] <= chance * sum) ++e;
    node = first + e;
    return sum;
}

// Mean share of the ways that is free, each counted by what would pass along it, and that of each node (the mean where it
// faces none). Some rays decide, from the receiver's nodes to the shooter's; others, between other places, `measure`: a
// transfer that is let pass because its rays were free must not be measured by them.
float free_ways(FaceElement a, FaceElement b, uint receiver, uint shooter, bool measure, bool is_small, uint rays_per_node, out float free[RULE_NODES])
{
    uint from = measure ? RECEIVER_NODES : 0, from_count = measure ? SHOOTER_NODES : RECEIVER_NODES;
    uint to = RECEIVER_NODES - from, to_count = RULE_NODES - from_count;
    uvec4 key = uvec4(a.cluster, b.cluster, a.instance + 65536u * b.instance, 0u);
    vec4 chances = unit_interval(pcg4d(key));
    uint first = 0, ray_count = 0, only;
    if (is_small) {
        // One way of all.
        float sums[RULE_NODES], sum = 0.0;
        [[dont_unroll]] for (uint r = 0; r < from_count; ++r) sums[r] = sum += drawn(receiver, from + r, shooter, to, to_count, 0.0, only);
        while (first + 1 < from_count && sums[first] <= chances.x * sum) ++first;
    }
    float weight_of[RULE_NODES], all = 0.0, passes = 0.0;
    [[dont_unroll]] for (uint r = 0; r < from_count; ++r) weight_of[r] = free[r] = 0.0;
    uint rays = is_small ? 1 : from_count * rays_per_node;
    // Where no faces look at each other, one ray between any.
    [[dont_unroll]] for (uint k = 0; k < rays || k == rays && ray_count == 0; ++k) {
        bool is_any = k == rays;
        uint r = is_any ? uint(chances.y * float(from_count)) : (first + k) % from_count, node;
        key.w = 1u + k + 256u * uint(measure);
        float weight = drawn(receiver, from + r, shooter, to, to_count, unit_interval(pcg4d(key)).x, node);
        if (weight <= 0.0 && !is_any) continue;
        weight = max(weight, 1e-30);
        vec3 x = receiver_node(receiver, from + r), y = receiver_node(shooter, node);
        float share = visibility(a, Ray(x, 1e-4, y - x, 1.0 - 1e-4));
        free[r] += share * (is_small ? 1.0 : 1.0 / float(rays_per_node));
        weight_of[r] = weight;
        all += weight;
        passes += weight * share;
        ++ray_count;
    }
    atomicAdd(pool[0].rays, ray_count);
    float mean = passes / all;
    [[dont_unroll]] for (uint r = 0; r < from_count; ++r)
        if (is_small || weight_of[r] <= 0.0) free[r] = mean;
    return mean;
}

// What is free of a node's ways, where rays that decided said `free` of it and `seen` of all, and others `measured` of all.
float corrected(float free, float seen, float measured)
{
    return measured < seen ? free * (measured / seen) : 1.0 - (1.0 - free) * ((1.0 - measured) / max(1.0 - seen, 1e-6));
}
#endif
