#ifndef DISPLAY_FINAL_GATHER
#define DISPLAY_FINAL_GATHER
// The final gather of one pixel: a cut through the sender tree is found, and each of its nodes gathered, in one walk.
//                                                                                              [Ritschel2008 4.4]
// The kernel that includes this says how it sees:
//     bool is_told(vec3 origin, vec3 target, uint leaf, out float free)  the share without a ray, where one can do without
//     float visibility(vec3 origin, vec3 target, uint leaf)              share of the way that is free, 0..1
// Bindings 0 to 6 and set 1 are the kernel's.
#include "lib/environment_sampling.glsl"
#include "lib/offset.glsl"
#include "lib/random.glsl"
#include "lib/sender_gather.glsl"

bool is_told(vec3 origin, vec3 target, uint leaf, out float free);
float visibility(vec3 origin, vec3 target, uint leaf);

// Of a pixel, means over its samples.
struct GatherCount {
    float cut_size;     // nodes gathered from
    float visited;      // nodes looked at
    float rays;         // cast
    vec3 lost;          // radiance that clamping took, W m^-2 sr^-1
};

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 7) uniform usampler2D visible_triangles;
layout(set = 0, binding = 8) uniform sampler2D g_position;
layout(set = 0, binding = 9) uniform sampler2D g_normal;
layout(set = 0, binding = 10) uniform sampler2D g_albedo;
layout(set = 0, binding = 11) uniform sampler2D g_specular;
layout(set = 0, binding = 12) uniform sampler2D g_emission;
layout(set = 0, binding = 13) uniform usamplerBuffer sender_nodes;      // SENDER_NODE_TEXELS each; compact: one
layout(set = 0, binding = 14) uniform usamplerBuffer sender_light;      // SENDER_LIGHT_TEXELS each
layout(set = 0, binding = 15) uniform usamplerBuffer sender_leaves;     // SENDER_LEAF_TEXELS each
layout(set = 0, binding = 16) uniform usamplerBuffer sender_branches;   // one each
layout(set = 0, binding = 17, scalar) readonly buffer Adaptation { float adaptation[]; };
layout(set = 0, binding = 18, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 19, scalar) readonly buffer EnvironmentInfos { EnvironmentInfo environment_info[]; };
layout(set = 0, binding = 20) uniform sampler2D environment_map;
layout(set = 0, binding = 21, scalar) readonly buffer EnvironmentCells { EnvironmentCell environment_cells[]; };
layout(set = 0, binding = 22, scalar) buffer Direct { vec3 direct[]; };
layout(set = 0, binding = 23, scalar) buffer Indirect { vec3 indirect[]; };
layout(set = 0, binding = 24, scalar) buffer GatherCounts { GatherCount gather_counts[]; };
// eye: position and 1, or the direction to an orthographic eye and 0; weight: of this sample of the pixel.
layout(set = 0, binding = 29, scalar) readonly buffer TreeFrames { SenderFrame tree_frame[]; };
layout(push_constant, scalar) uniform Params {
    vec4 eye;
    float weight;
    uint sample_index;
    uint seed;
    uint node_count;
    float threshold;            // of what the display shows, 0..1
    float exposure;             // factor on radiance after adaptation
    float key;                  // scaled luminance that the adaptation stands for; 0: radiance as it is
    float white;
    uint operator;
    float clamp_radii;          // senders stand at least so many of their radii away; 0: they are measured exactly
    uint jitter;
    uint environment_samples;
    float chance_below;         // of the threshold
    float map_reach;            // checked maps are not asked of senders nearer than so many of their radii
    float map_stretch;          // what maps see is looked over by rays this far from the receiver; pixels of a map
} params;

layout(constant_id = 2) const bool COMPACT = false;
bool sender_is_compact() { return COMPACT; }
SenderFrame sender_frame() { return tree_frame[0]; }
uvec4 sender_node_texel(uint i) { return texelFetch(sender_nodes, int(i)); }
uvec4 sender_light_texel(uint i) { return texelFetch(sender_light, int(i)); }
vec3 environment_texel(ivec2 texel) { return texelFetch(environment_map, texel, 0).rgb; }
EnvironmentCell environment_cell(uint index) { return environment_cells[index]; }

uvec4 sender_leaf_texel(uint i) { return texelFetch(sender_leaves, int(i)); }
uvec4 sender_branch_texel(uint i) { return texelFetch(sender_branches, int(i)); }

// The `k`-th direction to the environment: by the surface's lobe where the environment is even, and for half of them where
// the surface has a lobe; else by the environment. Each counts by what both together would draw it with.     [Veach1995]
Arrival environment_arrival(uint k, uvec4 random)
{
    EnvironmentInfo env = environment_info[0];
    Surface s = receiver.surface;
    bool is_even = env.width == 0;
    uint count = params.environment_samples, by_lobe = is_even ? count : has_specular(s) ? count / 2 : 0;
    vec4 u = fract(unit_interval(random) + float(params.sample_index) * vec4(0.7548777, 0.5698403, 0.6180340, 0.3247180));
    float drawn;
    vec3 direction;
    if (k < by_lobe) direction = brdf_sample(s, receiver.to_eye, u.z, u.xy);
    else direction = environment_sample(env, u.xy, u.zw, drawn);

    Arrival arrival = Arrival(vec3(0.0), vec3(0.0), vec3(0.0), receiver.position + 1e6 * direction, NO_SENDER);
    float cosine = dot(s.normal, direction);
    if (cosine <= 0.0 || dot(receiver.geometric, direction) <= 0.0) return arrival;
    float density = float(by_lobe) * brdf_density(s, receiver.to_eye, direction);
    if (!is_even) density += float(count - by_lobe) * environment_density(env, direction);
    if (density > 0.0)
        arrival.direct = brdf_value(s, receiver.to_eye, direction) * environment_radiance(env, direction) * (cosine / density);
    return arrival;
}

vec3 direct_sum, indirect_sum, lost_sum;     // W m^-2 sr^-1
uint gathered_pixel;

void keep(Arrival arrival, float free);

void take(Arrival arrival, float free)
{
    direct_sum += free * arrival.direct;
    indirect_sum += free * arrival.indirect;
    lost_sum += free * arrival.lost;
    keep(arrival, free);
    start_showing(shown_luminance + free * luminance(arrival.direct + arrival.indirect));
}

void gather(ivec2 pixel, uint index, uvec3 corners)
{
    vec4 position = texelFetch(g_position, pixel, 0), n = texelFetch(g_normal, pixel, 0);
    vec4 diffuse = texelFetch(g_albedo, pixel, 0), specular = texelFetch(g_specular, pixel, 0);
    vec3 a = positions[corners.x], b = positions[corners.y], c = positions[corners.z];
    vec3 to_eye = params.eye.w == 0.0 ? params.eye.xyz : normalize(params.eye.xyz - position.xyz);
    vec3 geometric = normalize(cross(b - a, c - a));
    if (dot(geometric, to_eye) < 0.0) geometric = -geometric;
    receiver = Receiver(position.xyz, geometric, to_eye, Surface(diffuse.rgb, specular.rgb, diffuse.w, n.w, vec3(0.0), n.xyz, true));
    slack = offset_length(a, b, c);
    vec3 origin = position.xyz + slack * geometric;

    float scale = params.exposure * (params.key > 0.0 && adaptation[0] > 0.0 ? params.key / adaptation[0] : 1.0);
    options = GatherOptions(params.threshold, scale, params.white, params.operator, params.clamp_radii, params.jitter != 0, params.sample_index, params.chance_below);
    lobe_draw = fract(unit_interval(pcg4d(uvec4(index, 0u, 3u, params.seed))).xy + float(params.sample_index) * vec2(0.7548777, 0.5698403));
    // What the pixel shows before this gather: the mean of its samples so far, this one's direct light included.
    float samples_so_far = params.weight * float(params.sample_index + 1);
    start_showing(luminance(direct[index] + indirect[index]) / samples_so_far);

    direct_sum = indirect_sum = lost_sum = vec3(0.0);
    gathered_pixel = index;
    uint node = 0, visited = 0, cut = 0, rays = 0, environment_taken = 0, most = 4;
    do {
        uint count = next_senders(most, node, params.node_count, visited), k = 0;
        most = more_senders(most);
        cut += count;
        // The environment comes behind the last node.
        uint environment_end = node < params.node_count ? 0 : params.environment_samples;
        while (true) {
            // Up to the next arrival that would bring light and needs a ray: threads in lockstep cast theirs together.
            Arrival arrival;
            bool found = false;
            while (!found && k < count) {
                uint taken = sender_batch[k++];
                float chance, free;
                arrival = arrival_of(taken, pcg4d(uvec4(index, taken, 0u, params.seed)), chance);
                found = is_worth_asking(arrival, chance);
                if (found && is_told(origin, arrival.target, arrival.leaf, free)) {
                    take(arrival, free);
                    found = false;
                }
            }
            while (!found && environment_taken < environment_end) {
                arrival = environment_arrival(environment_taken, pcg4d(uvec4(index, environment_taken, 1u, params.seed)));
                ++environment_taken;
                found = arrival.direct != vec3(0.0);
            }
            if (!found) break;
            ++rays;
            take(arrival, visibility(origin, arrival.target, arrival.leaf));
        }
    } while (node < params.node_count);
    direct[index] += params.weight * direct_sum;
    indirect[index] += params.weight * indirect_sum;
    gather_counts[index].cut_size += params.weight * float(cut);
    gather_counts[index].visited += params.weight * float(visited);
    gather_counts[index].rays += params.weight * float(rays);
    gather_counts[index].lost += params.weight * lost_sum;
}

void gather_pixel()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = textureSize(visible_triangles, 0);
    if (any(greaterThanEqual(pixel, size))) return;
    uint index = uint(pixel.y) * uint(size.x) + uint(pixel.x);
    if (params.sample_index == 0) gather_counts[index] = GatherCount(0.0, 0.0, 0.0, vec3(0.0));
    uint seen = texelFetch(visible_triangles, pixel, 0).x;
    if (seen == 0 || texelFetch(g_emission, pixel, 0).w <= 0.5) return;
    gather(pixel, index, triangles[seen - 1]);
}
#endif
