#version 460
#extension GL_EXT_nonuniform_qualifier : require
#include "lib/prelude.glsl"
#include "methods/face_cluster/receive.glsl"
#include "methods/face_cluster/triangle_vector.glsl"
#include "methods/face_cluster/ways.glsl"

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
    float wider;        // where light is blocked: times the receiver's area that a shooter may have before it is split first
} params;

// Flat shooters of so few faces, and nearer than so many half diagonals, are measured exactly.
const uint EXACT_FACES = 8;
const float EXACT_REACH = 10.0;

// Nearer to an element than half its size, its nodes do not tell how large it looks: the most of the hemisphere that it may
// fill, and 0 farther off.
float nearness(FaceElement e, float squared)
{
    return squared < 0.25 * dot(e.half_extent, e.half_extent) ? min(1.0, e.area / (PI * squared)) : 0.0;
}

// Irradiance vector at x, above its plane, of those of few faces of radiosity 1 that look at x.
vec3 exact_vector(FaceElement b, vec3 x, vec3 normal)
{
    ClusterInstance inst = instances[b.instance];
    float side = inst.is_back != 0 ? 1.0 : -1.0;    // edges counterclockwise as seen from x make a vector away
    vec3 sum = vec3(0.0);
    [[dont_unroll]] for (uint f = 0; f < b.place_count; ++f) {
        uvec3 v = triangles[inst.first_triangle + tree_faces[inst.first_face + b.first_place + f - inst.first_triangle]];
        vec3 of_face = side * triangle_vector(x, normal, vec3[3](positions[v.x], positions[v.y], positions[v.z]));
        if (dot(of_face, normal) > 0.0) sum += of_face;
    }
    return sum;
}

// What is kept of a vector that is part of all.
vec3 kept_part(FaceElement a, vec3 v) { return dot(v, v) > 0.0 ? length(v) * kept_vector(a, normalize(v)) : vec3(0.0); }

float most(vec3 v) { return max(v.x, max(v.y, v.z)); }

void main()
{
    uint i = linear_index();
    if (i >= counters[0].taken) return;
    if (pool[0].is_full != 0) {
        decisions[i] = PAIR_WAITS;
        return;
    }
    uint receiver = taken_pairs[i].x, shooter = taken_pairs[i].y & ~IN_SHADOW, shadow = taken_pairs[i].y & IN_SHADOW;
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
    bool is_face = b.place_count == 1, is_exact = b.place_count <= EXACT_FACES && is_flat(b);
    // Differs from [Gobbetti2003]: bounds between nodes alone miss what touches, or lies close above.
    float near_power = brightest * b.area * nearness(a, squared_distance(a, b.center));
    bool is_far = true;
    [[dont_unroll]] for (uint r = 0; r < RECEIVER_NODES; ++r) {
        vec3 x = receiver_node(receiver, r);
        at_nodes[r] = mat3(0.0);
        least[r] = 3e38;
        float off = squared_distance(b, x);
        greatest[r] = is_face ? near_power : max(near_power, brightest * a.area * nearness(b, off));
        is_far = is_far && off > 4.0 * dot(b.half_extent, b.half_extent);
        float sum = 0.0;
        vec3 sent = vec3(0.0);
        bool sends = false;
        [[dont_unroll]] for (uint e = 0; e < SHOOTER_NODES; ++e) {
            vec3 d = shooter_node(shooter, e) - x;
            float squared = max(dot(d, d), 1e-20);
            vec3 direction = d / sqrt(squared);
            float scale = most(radiosity[e]) / (PI * squared);
            least[r] = min(least[r], scale * least_projected_area(b, -direction) * least_projected_area(a, direction));
            greatest[r] = max(greatest[r], scale * most_projected_area(b, -direction) * most_projected_area(a, direction));
            // m(x, y) B(y).                                                                    [Gobbetti2003 Eq. 3]
            float share = shooter_weight(shooter, e) * projected_area(b, -direction) / (PI * squared);
            vec3 kept = share * kept_vector(a, direction);
            sends = sends || share > 0.0;
            sum += length(kept);
            sent += length(kept) * radiosity[e];
            at_nodes[r] += outerProduct(kept, radiosity[e]);
        }
        // Neighbours stand nearer than nodes can tell, and those of faces that do not fill a square stand unevenly.
        if (sends && (is_face || is_exact && off < EXACT_REACH * EXACT_REACH * dot(b.half_extent, b.half_extent))) {
            vec3 mean = sum > 0.0 ? sent / sum : radiosity[0], above = exact_vector(b, x, a.axis_z);
            // Faces that look aside see what lies below the mean one's horizon.
            vec3 below = is_flat(a) ? vec3(0.0) : exact_vector(b, x, -a.axis_z);
            sum = length(above) + length(below);
            at_nodes[r] = outerProduct(kept_part(a, above) + kept_part(a, below), mean);
        }
        // No surface receives more than a hemisphere of the shooter's light.
        if (sum > 1.0) at_nodes[r] /= sum;
        greatest_of_all = max(greatest_of_all, greatest[r]);
    }
    float reflected = a.most_albedo * greatest_of_all;  // W, at most
    // What lights a receiver from many sides cancels in one vector, and a shooter is not as bright on all its sides: where
    // that is too much light, faces must be met apart, small as they are.
    bool is_bright = greatest_of_all > params.bent_light * a.area, splits_a = is_met_apart(a, is_bright, reflected, params.threshold) && can_split(a);
    if (splits_a || is_met_apart(b, is_bright, reflected, params.threshold) && can_split(b)) {
        decisions[i] = (splits_a ? SPLIT_RECEIVER : SPLIT_SHOOTER) | shadow;
        return;
    }
    bool is_small = reflected <= params.threshold;  // an error of all of it does not matter: one ray is enough

    passed_places = uvec4(a.first_place, a.place_count, b.first_place, b.place_count);
    float wider = is_far && shadow != 0 ? params.wider : 1.0;
    uint split = can_split(a) && (wider * a.area >= b.area || !can_split(b)) ? SPLIT_RECEIVER : SPLIT_SHOOTER;
    bool may_split = can_split(a) || can_split(b);
    mat3 on_functions[IRRADIANCE_FUNCTIONS];
    float free[RULE_NODES], shares[RULE_NODES];
    float seen = 1.0, strongest_at = 0.0;   // W
    [[dont_unroll]] for (uint round = 0; round < 2; ++round) {
        bool measures = round == 1;
        float mean = free_ways(a, b, receiver, shooter, measures, is_small, params.rays_per_node, shares);
        if (measures || is_small) {
            // Where both kinds of rays differ by too much light, neither is trusted.
            if (measures && may_split && a.most_albedo * abs(mean - seen) * strongest_at > params.threshold) {
                decisions[i] = split | IN_SHADOW;
                return;
            }
            if (mean <= 0.0) return;
            [[dont_unroll]] for (uint r = 0; r < RECEIVER_NODES; ++r) at_nodes[r] *= is_small ? mean : corrected(free[r], seen, mean);
            project(receiver, at_nodes, on_functions);
            break;
        }
        // What few rays miss is not dark: it is looked for in the halves, until all of it is as little as other errors.
        if (mean <= 0.0 && may_split) {
            decisions[i] = split | IN_SHADOW;
            return;
        }
        float all = 0.0;
        seen = 0.0;
        mat3 seen_at[RECEIVER_NODES];
        [[dont_unroll]] for (uint r = 0; r < RECEIVER_NODES; ++r) {
            free[r] = shares[r];
            float size = length(at_nodes[r][0]) + length(at_nodes[r][1]) + length(at_nodes[r][2]);
            seen += size * free[r];
            all += size;
            strongest_at = max(strongest_at, vector_area(a) * most(a.axis_z * at_nodes[r]));
            seen_at[r] = free[r] * at_nodes[r];
            if (free[r] < 0.999) least[r] = 0.0;
            if (free[r] == 0.0) greatest[r] = 0.0;
        }
        seen = all > 0.0 ? seen / all : 1.0;
        if (!may_split) continue;
        // The error: how far the bounds lie from what the functions say.                       [Gobbetti2003 3.3.2]
        project(receiver, seen_at, on_functions);
        float error = error_of(a, receiver, on_functions, unshot[shooter * RADIOSITY_FUNCTIONS], least, greatest, seen < 0.999 ? greatest_of_all : 0.0);
        if (a.most_albedo * error > params.threshold) {
            decisions[i] = split | (seen < 0.999 ? IN_SHADOW : shadow);
            return;
        }
    }
    receive(receiver, on_functions, params.units);
}
