#version 460
#extension GL_EXT_nonuniform_qualifier : require
#include "lib/prelude.glsl"
#include "methods/face_cluster/receive.glsl"
#include "methods/face_cluster/triangle_vector.glsl"

// One thread per (receiver, shooter) pair of the step: transports the shooter's unshot light if the bounds on what the
// receiver reflects of it are tight enough, else says which of them is to be split.            [Gobbetti2003 3.3]
// reads counters, taken_pairs, unshot and the tables of receive   updates arriving, pool   writes decisions   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 13, scalar) readonly buffer Counters { PairCounters counters[]; };
layout(set = 0, binding = 14, scalar) readonly buffer Taken { uvec2 taken_pairs[]; };
layout(set = 0, binding = 15, scalar) readonly buffer Unshot { vec3 unshot[]; };    // per element and function, W/m2
layout(set = 0, binding = 16, scalar) writeonly buffer Decisions { uint decisions[]; };
layout(constant_id = 4) const uint RADIOSITY_FUNCTIONS = 1u;
layout(push_constant, scalar) uniform Params {
    float threshold;    // W, of a transfer's error
    float bent_light;   // W/m2, that a bent receiver may get as a whole
    float units;        // per W/m2
    uint rays_per_node;
} params;

float most(vec3 v) { return max(v.x, max(v.y, v.z)); }

void main()
{
    uint i = linear_index();
    if (i >= counters[0].taken) return;
    if (pool[0].is_full != 0) {
        decisions[i] = PAIR_WAITS;
        return;
    }
    uint receiver = taken_pairs[i].x, shooter = taken_pairs[i].y;
    FaceElement a = elements[receiver], b = elements[shooter];
    decisions[i] = PAIR_IS_DONE;
    float brightest = most(unshot[shooter * RADIOSITY_FUNCTIONS]);
    if (brightest <= 0.0) return;

    if (receiver == shooter) {
        // Self transfer: what a cluster that is not convex may send itself.                    [Gobbetti2003 3.3.3]
        float power = a.self_share * a.area;
        if (can_split(a) && a.most_albedo * brightest * power > params.threshold) {
            decisions[i] = SPLIT_BOTH;
        } else if (power > 0.0) {
            // Where it comes from within the cluster is not known: along the mean normal.
            mat3 on_functions[IRRADIANCE_FUNCTIONS];
            vec3 kept = power / max(vector_area(a), LEAST_FLAT_SHARE * a.area) * a.axis_z;
            [[dont_unroll]] for (uint k = 0; k < IRRADIANCE_FUNCTIONS; ++k)
                on_functions[k] = k < RADIOSITY_FUNCTIONS ? outerProduct(kept, unshot[shooter * RADIOSITY_FUNCTIONS + k]) : mat3(0.0);
            receive(receiver, on_functions, params.units);
        }
        return;
    }
    if (!may_face(a, b) || !may_face(b, a)) return;

    uint rule = RECEIVER_NODES + (b.place_count == 1 ? RULE_NODES : 0);
    vec3 radiosity[SHOOTER_NODES];
    [[dont_unroll]] for (uint e = 0; e < SHOOTER_NODES; ++e) {
        radiosity[e] = unshot[shooter * RADIOSITY_FUNCTIONS];
        [[dont_unroll]] for (uint k = 1; k < RADIOSITY_FUNCTIONS; ++k)
            radiosity[e] += basis(k, node_coordinates(b, shooter, RECEIVER_NODES + e)) * unshot[shooter * RADIOSITY_FUNCTIONS + k];
        radiosity[e] = max(radiosity[e], vec3(0.0));
    }

    // Unoccluded: what arrives at each node, and bounds on what the whole receiver would reflect under that light, W.
    mat3 at_nodes[RECEIVER_NODES];
    float least[RECEIVER_NODES], greatest[RECEIVER_NODES];
    float greatest_of_all = 0.0;
    // A single face is measured exactly: neighbours stand nearer than nodes can tell.
    bool is_face = b.place_count == 1;
    vec3 corners[3];
    if (is_face) {
        ClusterInstance inst = instances[b.instance];
        uvec3 v = triangles[inst.first_triangle + tree_faces[inst.first_face + b.first_place - inst.first_triangle]];
        corners = vec3[3](positions[v.x], positions[v.y], positions[v.z]);
    }
    [[dont_unroll]] for (uint r = 0; r < RECEIVER_NODES; ++r) {
        vec3 x = receiver_node(receiver, r);
        at_nodes[r] = mat3(0.0);
        least[r] = 3e38;
        greatest[r] = 0.0;
        float sum = 0.0;
        bool sends = false;
        [[dont_unroll]] for (uint e = 0; e < SHOOTER_NODES; ++e) {
            vec3 d = shooter_node(shooter, e) - x;
            float squared = max(dot(d, d), 1e-20);
            vec3 direction = d / sqrt(squared);
            float scale = most(radiosity[e]) / (PI * squared);
            least[r] = min(least[r], scale * least_projected_area(b, -direction) * least_projected_area(a, direction));
            greatest[r] = max(greatest[r], scale * most_projected_area(b, -direction) * most_projected_area(a, direction));
            // m(x, y) B(y).                                                                    [Gobbetti2003 Eq. 3]
            float share = rules[rule + e].weight * projected_area(b, -direction) / (PI * squared);
            vec3 kept = share * kept_vector(a, direction);
            sends = sends || share > 0.0;
            sum += length(kept);
            at_nodes[r] += outerProduct(kept, radiosity[e]);
        }
        if (is_face && sends) {
            vec3 exact = triangle_vector(x, a.axis_z, corners);
            if (dot(exact, a.axis_z) < 0.0) exact = -exact;
            sum = length(exact);
            at_nodes[r] = sum > 0.0 ? outerProduct(sum * kept_vector(a, exact / sum), radiosity[0]) : mat3(0.0);
        }
        // No surface receives more than a hemisphere of the shooter's light.
        if (sum > 1.0) at_nodes[r] /= sum;
        greatest_of_all = max(greatest_of_all, greatest[r]);
    }
    // What lights a receiver from many sides cancels in one vector, and a shooter is not as bright on all its sides: where
    // that is too much light, faces must be met apart, small as they are.
    bool splits_a = is_bent(a) && can_split(a), splits_b = is_bent(b) && can_split(b);
    if ((splits_a || splits_b) && greatest_of_all > params.bent_light * a.area) {
        decisions[i] = splits_a ? SPLIT_RECEIVER : SPLIT_SHOOTER;
        return;
    }
    // So little that even an error of all of it does not matter needs no more than one ray.
    bool is_small = a.most_albedo * greatest_of_all <= params.threshold;

    passed_places = uvec4(a.first_place, a.place_count, b.first_place, b.place_count);
    uint turn = a.cluster * 7u + b.cluster * 13u;
    float free[RECEIVER_NODES];
    uint rays_from[RECEIVER_NODES];
    uint ray_count = 0, most_rays = is_small ? 1 : RECEIVER_NODES * params.rays_per_node;
    float sum_free = 0.0;
    [[dont_unroll]] for (uint r = 0; r < RECEIVER_NODES; ++r) {
        free[r] = 0.0;
        rays_from[r] = 0;
    }
    // Faces that look away say nothing of what the others see: first come nodes that face each other, then, where there
    // are none at all, any.
    [[dont_unroll]] for (uint k = 0; k < RECEIVER_NODES * (params.rays_per_node + 1) && ray_count < most_rays; ++k) {
        uint r = (is_small ? turn + k : k) % RECEIVER_NODES;
        bool is_any = k >= RECEIVER_NODES * params.rays_per_node;
        if (is_any && ray_count > 0) break;
        vec3 x = receiver_node(receiver, r), normal = node_normal(receiver, r), y;
        bool faces = false;
        [[dont_unroll]] for (uint e = 0; e < SHOOTER_NODES && !faces; ++e) {
            uint s = RECEIVER_NODES + (turn + k + e) % SHOOTER_NODES;
            y = receiver_node(shooter, s);
            faces = dot(y - x, normal) > 0.0 && dot(x - y, node_normal(shooter, s)) > 0.0;
        }
        if (!faces && !is_any) continue;
        float share = visibility(a, Ray(x, 1e-4, y - x, 1.0 - 1e-4));
        free[r] += share;
        sum_free += share;
        ++rays_from[r];
        ++ray_count;
    }
    atomicAdd(pool[0].rays, ray_count);
    bool any_free = sum_free > 0.0;
    [[dont_unroll]] for (uint r = 0; r < RECEIVER_NODES; ++r)
        free[r] = rays_from[r] > 0 && !is_small ? free[r] / float(rays_from[r]) : sum_free / float(max(ray_count, 1));
    uint split = can_split(a) && (a.area >= b.area || !can_split(b)) ? SPLIT_RECEIVER : SPLIT_SHOOTER;
    bool may_split = can_split(a) || can_split(b);
    if (!any_free) {
        // What few rays miss is not dark: where that is too much to lose, it is looked for in the halves.
        if (may_split && a.most_albedo * greatest_of_all > WORTH_LOOKING_ON * params.threshold) decisions[i] = split;
        return;
    }
    [[dont_unroll]] for (uint r = 0; r < RECEIVER_NODES; ++r) {
        at_nodes[r] *= free[r];
        if (free[r] < 0.999) least[r] = 0.0;
        if (free[r] == 0.0) greatest[r] = 0.0;
    }

    mat3 on_functions[IRRADIANCE_FUNCTIONS];
    project(receiver, at_nodes, on_functions);
    if (!is_small && may_split) {
        // The error: how far the bounds lie from what the functions say.                       [Gobbetti2003 3.3.2]
        float error = 0.0;
        vec3 strongest = unshot[shooter * RADIOSITY_FUNCTIONS];
        uint channel = strongest.x >= max(strongest.y, strongest.z) ? 0 : strongest.y >= strongest.z ? 1 : 2;
        [[dont_unroll]] for (uint r = 0; r < RECEIVER_NODES; ++r) {
            float said = 0.0;
            vec2 uv = node_coordinates(a, receiver, r);
            [[dont_unroll]] for (uint k = 0; k < IRRADIANCE_FUNCTIONS; ++k)
                said += basis(k, uv) * dot(a.axis_z, on_functions[k][channel]);
            said *= vector_area(a);
            error = max(error, max(said - least[r], greatest[r] - said));
        }
        if (a.most_albedo * error > params.threshold) {
            decisions[i] = split;
            return;
        }
    }
    receive(receiver, on_functions, params.units);
}
