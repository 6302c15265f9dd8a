#version 460
#extension GL_EXT_nonuniform_qualifier : require
#include "lib/prelude.glsl"
#include "lib/brdf.glsl"
#include "lib/emissive_triangle.glsl"
#include "lib/environment_sampling.glsl"
#include "lib/light.glsl"
#include "lib/offset.glsl"
#include "lib/random.glsl"
#include "lib/ray.glsl"
#include "methods/path_tracing/path.glsl"

// One thread per path: one sample of one light, of a kind chosen by fixed probabilities: a point of an emissive
// triangle, a direction of the environment, or a punctual light. The ray asks whether it is seen.    [Veach1995 5]
// reads rays, paths, vertices [path_count], emitters[emitter_count], lights[light_count], the scene
// writes shadow_rays[path_count] (inactive where nothing can arrive), connections[path_count] (radiance at the eye if
// the ray is free, W m^-2 sr^-1)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Paths { Path paths[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Vertices { PathVertex vertices[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 4, scalar) readonly buffer TriangleMaterials { uint triangle_materials[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Attributes { VertexAttributes attributes[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Materials { Material materials[]; };
layout(set = 0, binding = 8, scalar) readonly buffer Emitters { EmissiveTriangle emitters[]; };
layout(set = 0, binding = 9, scalar) readonly buffer Lights { Light lights[]; };
layout(set = 0, binding = 10, scalar) readonly buffer EnvironmentInfos { EnvironmentInfo environment_info[]; };
layout(set = 0, binding = 11, scalar) readonly buffer EnvironmentCells { EnvironmentCell environment_cells[]; };
layout(set = 0, binding = 12) uniform sampler2D environment_map;
layout(set = 0, binding = 13, scalar) writeonly buffer ShadowRays { Ray shadow_rays[]; };
layout(set = 0, binding = 14, scalar) writeonly buffer Connections { vec3 connections[]; };
layout(set = 1, binding = 0) uniform sampler2D textures[];
layout(push_constant, scalar) uniform Params {
    Batch batch;
    uint depth;             // vertices before this one
    uint emitter_count;
    uint light_count;
    LightChoice choice;
} params;

vec4 sample_texture(TextureSlot slot, vec2 uv) { return textureLod(textures[nonuniformEXT(slot.texture)], uv, 0.0); }
vec3 environment_texel(ivec2 texel) { return texelFetch(environment_map, texel, 0).rgb; }
EnvironmentCell environment_cell(uint index) { return environment_cells[index]; }

// A chance for light to arrive: what would, over the density, and from where.
struct LightSample {
    vec3 value;         // radiance / density, or irradiance / probability of a punctual light
    vec3 direction;     // unit, towards the light
    vec3 reach;         // what must be free: the ray's origin + t reach for 0 <= t <= t_max
    float t_max;
    float density;      // sr^-1; 0: reflection cannot find this light
};

LightSample emitter_sample(vec3 origin, uint word, float alternative, vec2 u)
{
    LightSample light;
    light.value = vec3(0.0);
    uint slot = alias_slot(word, params.emitter_count);
    if (alternative >= emitters[slot].threshold) slot = emitters[slot].alias;
    EmissiveTriangle emitter = emitters[slot];

    uvec3 v = triangles[emitter.triangle];
    vec3 w = uniform_weights(u);
    vec3 a = positions[v.x], b = positions[v.y], c = positions[v.z];
    vec3 normal = cross(b - a, c - a);
    float squared = dot(normal, normal);
    if (squared == 0.0 || emitter.density == 0.0) return light;
    normal /= sqrt(squared);
    vec3 point = w.x * a + w.y * b + w.z * c;
    Material m = materials[triangle_materials[emitter.triangle]];
    float side = dot(normal, origin - point) < 0.0 ? -1.0 : 1.0;
    if (side < 0.0 && (m.flags & DOUBLE_SIDED) == 0) return light;

    vec3 along = point - origin;
    float distance_squared = dot(along, along);
    if (distance_squared == 0.0) return light;
    light.direction = along / sqrt(distance_squared);
    float cosine = abs(dot(normal, light.direction));
    if (cosine < 1e-6) return light;
    light.density = params.choice.emitters * emitter.density * distance_squared / cosine;

    VertexAttributes at = interpolated(attributes[v.x], attributes[v.y], attributes[v.z], w);
    if (is_hole_of(m, at)) return light;
    light.value = emission_of(m, at) / light.density;
    light.reach = point + side * offset_length(a, b, c) * normal - origin;
    light.t_max = 1.0;
    return light;
}

LightSample environment_light(vec2 choose, vec2 inside)
{
    EnvironmentInfo env = environment_info[0];
    LightSample light;
    light.direction = environment_sample(env, choose, inside, light.density);
    light.density *= params.choice.environment;
    light.reach = light.direction;
    light.t_max = 1e30;
    light.value = light.density > 0.0 ? environment_radiance(env, light.direction) / light.density : vec3(0.0);
    return light;
}

// One of all punctual lights, drawn in proportion to its irradiance here before shadows: exactly, in one sweep.
//                                                                                                    [Chao1982]
LightSample punctual_sample(vec3 origin, vec3 normal, float u)
{
    LightSample chosen;
    chosen.value = vec3(0.0);
    chosen.density = 0.0;
    float total = 0.0, chosen_weight = 0.0;
    for (uint k = 0; k < params.light_count; ++k) {
        vec3 to_light;
        float distance_to_light;
        vec3 arriving = light_irradiance(lights[k], origin, to_light, distance_to_light);
        float weight = max(arriving.r, max(arriving.g, arriving.b)) * max(dot(normal, to_light), 0.0);
        if (!(weight > 0.0)) continue;
        total += weight;
        float share = weight / total;
        if (u < share) {
            u = u / share;
            chosen_weight = weight;
            chosen.value = arriving;
            chosen.direction = to_light;
            chosen.reach = to_light;
            chosen.t_max = distance_to_light;
        } else {
            u = (u - share) / (1.0 - share);
        }
        u = min(u, 0.99999994);
    }
    if (total > 0.0) chosen.value *= total / (chosen_weight * params.choice.punctual);
    return chosen;
}

void main()
{
    uint i = linear_index();
    if (i >= params.batch.path_count) return;

    shadow_rays[i].t_max = -1.0;
    connections[i] = vec3(0.0);
    PathVertex vertex = vertices[i];
    if (vertex.reflects == 0) return;

    uint pixel = pixel_of(params.batch, i), sample_index = sample_of(params.batch, i);
    uvec4 words = sample_words(pixel, sample_index, light_dimension(params.depth), params.batch.seed);
    vec2 inside = unit_interval(words.xy), which = unit_interval(words.zw);
    uvec4 further = sample_words(pixel, sample_index, reflection_dimension(params.depth), params.batch.seed);
    float kind = unit_interval(further.w);
    vec3 origin = vertex.position + vertex.offset * vertex.geometric_normal;

    LightSample light;
    LightChoice choice = params.choice;
    if (kind < choice.emitters) light = emitter_sample(origin, words.z, which.y, inside);
    else if (kind < choice.emitters + choice.environment) light = environment_light(which, inside);
    else light = punctual_sample(origin, vertex.normal, which.x);
    if (light.value == vec3(0.0) || dot(vertex.geometric_normal, light.direction) <= 0.0) return;

    Surface s = surface_at(vertex);
    vec3 to_eye = -rays[i].direction;
    float cosine = dot(s.normal, light.direction);
    vec3 reflected = brdf_value(s, to_eye, light.direction) * light.value * max(cosine, 0.0);
    if (light.density > 0.0) reflected *= light_weight(light.density, brdf_density(s, to_eye, light.direction));
    reflected *= paths[i].throughput;
    if (reflected == vec3(0.0)) return;

    connections[i] = reflected;
    shadow_rays[i].origin = origin;
    shadow_rays[i].t_min = 0.0;
    shadow_rays[i].direction = light.reach;
    shadow_rays[i].t_max = light.t_max;
}
