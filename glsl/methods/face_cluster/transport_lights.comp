#version 460
#extension GL_EXT_nonuniform_qualifier : require
#include "lib/prelude.glsl"
#include "lib/light.glsl"
#include "methods/face_cluster/receive.glsl"

// One thread per (receiver, light) pair of the step: as transport, for punctual lights and distant emitters, which are
// never split.                                                                                  [Gobbetti2003 3.3]
// reads counters, taken_pairs, lights and the tables of receive   updates arriving, pool   writes decisions   shared none
// Differs from [Gobbetti2003]: there all light comes from clusters.
layout(local_size_x = 64) in;
layout(set = 0, binding = 13, scalar) readonly buffer Counters { PairCounters counters[]; };
layout(set = 0, binding = 14, scalar) readonly buffer Taken { uvec2 taken_pairs[]; };
layout(set = 0, binding = 15, scalar) readonly buffer Lights { Light lights[]; };
layout(set = 0, binding = 16, scalar) writeonly buffer Decisions { uint decisions[]; };
layout(push_constant, scalar) uniform Params {
    float threshold;    // W, of a transfer's error
    float bent_light;   // W/m2, that a bent receiver may get as a whole
    float units;        // per W/m2
    float far;          // metres: beyond everything
    float ray_offset;   // metres
} params;

float most(vec3 v) { return max(v.x, max(v.y, v.z)); }

// The most that may arrive anywhere within a sphere, W/m2: a cone, or the end of a range, may pass between nodes.
float most_irradiance(Light light, vec3 center, float radius)
{
    if (light.kind == LIGHT_DIRECTIONAL) return most(light.intensity);
    vec3 offset = center - light.position, to_light;
    float distance_to_center = length(offset), distance_to_light;
    // The sphere's place that is nearest to the lamp, turned into its cone as far as the sphere goes.
    float nearest = max(distance_to_center - radius, 0.01 * radius);
    vec3 way = nearest * light.direction;
    if (light.kind == LIGHT_SPOT && distance_to_center > radius) {
        float sine_reach = radius / distance_to_center, cosine_reach = sqrt(1.0 - sine_reach * sine_reach);
        float cosine = dot(offset, light.direction) / distance_to_center;
        if (cosine < cosine_reach) {
            float sine = sqrt(max(1.0 - cosine * cosine, 0.0)), turned = cosine * cosine_reach + sine * sine_reach;
            vec3 aside = cross(light.direction, abs(light.direction.x) < 0.5 ? vec3(1, 0, 0) : vec3(0, 1, 0));
            way = nearest * (turned * light.direction + sqrt(max(1.0 - turned * turned, 0.0)) * normalize(aside));
        }
    }
    return most(light_irradiance(light, light.position + way, to_light, distance_to_light));
}

void main()
{
    uint i = linear_index();
    if (i >= counters[0].taken) return;
    if (pool[0].is_full != 0) {
        decisions[i] = PAIR_WAITS;
        return;
    }
    uint receiver = taken_pairs[i].x;
    FaceElement a = elements[receiver];
    Light light = lights[taken_pairs[i].y & ~IS_LIGHT];
    decisions[i] = PAIR_IS_DONE;

    mat3 at_nodes[RECEIVER_NODES];
    float least[RECEIVER_NODES], greatest[RECEIVER_NODES];
    float greatest_of_all = 0.0;
    passed_places = uvec4(a.first_place, a.place_count, 0, 0);
    float brightest_of_all = most_irradiance(light, a.center, length(a.half_extent));
    [[dont_unroll]] for (uint r = 0; r < RECEIVER_NODES; ++r) {
        vec3 x = receiver_node(receiver, r), direction;
        float distance_to_light;
        vec3 arrives = light_irradiance(light, x, direction, distance_to_light);
        // Where none comes to the node, some may come beside it.
        float brightest = most(arrives) > 0.0 ? most(arrives) : brightest_of_all;
        least[r] = most(arrives) * least_projected_area(a, direction);
        greatest[r] = brightest * most_projected_area(a, direction);
        greatest_of_all = max(greatest_of_all, greatest[r]);
        at_nodes[r] = outerProduct(kept_vector(a, direction), arrives);
    }
    // Nothing is kept from behind the mean normal: what many faces look at must find them apart, small as they are.
    float reflected = a.most_albedo * greatest_of_all;  // W, at most
    if (is_met_apart(a, greatest_of_all > params.bent_light * a.area, reflected, params.threshold) && can_split(a)) {
        decisions[i] = SPLIT_RECEIVER;
        return;
    }
    if (greatest_of_all <= 0.0) return;
    bool is_small = reflected <= params.threshold;
    uint turn = a.cluster % RECEIVER_NODES, ray_count = 0;
    float free[RECEIVER_NODES], sum_free = 0.0;
    bool is_asked[RECEIVER_NODES];
    [[dont_unroll]] for (uint r = 0; r < RECEIVER_NODES; ++r) is_asked[r] = false;
    // As in transport: faces that look away say nothing of what the others see.
    [[dont_unroll]] for (uint k = 0; k < 2 * RECEIVER_NODES && !(is_small && ray_count > 0); ++k) {
        uint r = (is_small ? turn + k : k) % RECEIVER_NODES;
        if (k >= RECEIVER_NODES && ray_count > 0) break;
        vec3 x = receiver_node(receiver, r), direction;
        float distance_to_light;
        if (most(light_irradiance(light, x, direction, distance_to_light)) <= 0.0) continue;
        if (dot(direction, node_normal(receiver, r)) <= 0.0 && k < RECEIVER_NODES) continue;
        Ray ray = Ray(x, params.ray_offset, direction, min(distance_to_light, params.far));
        free[r] = greatest[r] > 0.0 ? visibility(a, ray) : 0.0;
        sum_free += free[r];
        is_asked[r] = true;
        ++ray_count;
    }
    atomicAdd(pool[0].rays, ray_count);
    float mean_free = sum_free / float(max(ray_count, 1));
    if (sum_free <= 0.0) {
        // As in transport: what may still be free is looked for where it is too much to lose.
        if (can_split(a) && !is_small) decisions[i] = SPLIT_RECEIVER;
        return;
    }
    [[dont_unroll]] for (uint r = 0; r < RECEIVER_NODES; ++r) {
        float share = is_small || !is_asked[r] ? mean_free : free[r];
        at_nodes[r] *= share;
        if (share < 0.999) least[r] = 0.0;
        if (share == 0.0) greatest[r] = 0.0;
    }

    mat3 on_functions[IRRADIANCE_FUNCTIONS];
    project(receiver, at_nodes, on_functions);
    if (!is_small && can_split(a)) {
        float error = error_of(a, receiver, on_functions, light.intensity, least, greatest, mean_free < 0.999 ? greatest_of_all : 0.0);
        if (a.most_albedo * error > params.threshold) {
            decisions[i] = SPLIT_RECEIVER;
            return;
        }
    }
    receive(receiver, on_functions, params.units);
}
