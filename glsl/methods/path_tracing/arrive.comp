#version 460
#extension GL_EXT_nonuniform_qualifier : require
#include "lib/prelude.glsl"
#include "lib/environment_sampling.glsl"
#include "lib/offset.glsl"
#include "lib/ray.glsl"
#include "lib/unit.glsl"
#include "methods/path_tracing/path.glsl"

// One thread per path: what its ray brings from where it arrives, emission or environment, weighted against light
// sampling; and the surface there.                                                     [Veach1995 5; Kajiya1986 4]
// reads rays, hits, paths [path_count], the scene, emitter_density[triangle_count] (m^-2)
// updates radiance[path_count] (W m^-2 sr^-1)   writes vertices[path_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Hits { Hit hits[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Paths { Path paths[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 4, scalar) readonly buffer TriangleMaterials { uint triangle_materials[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Normals { vec3 normals[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Tangents { vec4 tangents[]; };
layout(set = 0, binding = 8, scalar) readonly buffer Attributes { VertexAttributes attributes[]; };
layout(set = 0, binding = 9, scalar) readonly buffer Materials { Material materials[]; };
layout(set = 0, binding = 10, scalar) readonly buffer EmitterDensity { float emitter_density[]; };
layout(set = 0, binding = 11, scalar) readonly buffer EnvironmentInfos { EnvironmentInfo environment_info[]; };
layout(set = 0, binding = 12, scalar) readonly buffer EnvironmentCells { EnvironmentCell environment_cells[]; };
layout(set = 0, binding = 13) uniform sampler2D environment_map;
layout(set = 0, binding = 14, scalar) buffer Radiance { vec3 radiance[]; };
layout(set = 0, binding = 15, scalar) writeonly buffer Vertices { PathVertex vertices[]; };
layout(set = 1, binding = 0) uniform sampler2D textures[];
layout(push_constant, scalar) uniform Params { uint path_count; uint is_last; LightChoice choice; } params;

vec4 sample_texture(TextureSlot slot, vec2 uv) { return textureLod(textures[nonuniformEXT(slot.texture)], uv, 0.0); }
vec3 environment_texel(ivec2 texel) { return texelFetch(environment_map, texel, 0).rgb; }
EnvironmentCell environment_cell(uint index) { return environment_cells[index]; }

// Radiance from where no surface is.
vec3 escaped(Path path, vec3 direction)
{
    EnvironmentInfo env = environment_info[0];
    if (env.is_black != 0) return vec3(0.0);
    vec3 arriving = path.throughput * environment_radiance(env, direction);
    if (path.density == 0.0) return arriving;
    return arriving * reflection_weight(path.density, params.choice.environment * environment_density(env, direction));
}

void main()
{
    uint i = linear_index();
    if (i >= params.path_count) return;

    Ray ray = rays[i];
    Hit hit = hits[i];
    Path path = paths[i];
    if (!is_hit(hit)) {
        vertices[i].reflects = 0;
        if (is_active(ray)) radiance[i] += escaped(path, ray.direction);
        return;
    }

    // The surface, interpolated.
    uint triangle = triangle_index(hit);
    uvec3 v = triangles[triangle];
    vec3 w = barycentric_weights(hit);
    Material m = materials[triangle_materials[triangle]];
    VertexAttributes at = interpolated(attributes[v.x], attributes[v.y], attributes[v.z], w);
    vec3 a = positions[v.x], b = positions[v.y], c = positions[v.z];
    bool is_back = is_back_face(hit);
    vec3 front = unit_or(cross(b - a, c - a), vec3(0.0, 1.0, 0.0));
    vec3 normal = unit_or(w.x * normals[v.x] + w.y * normals[v.y] + w.z * normals[v.z], front);
    vec4 tangent = w.x * tangents[v.x] + w.y * tangents[v.y] + w.z * tangents[v.z];
    tangent.xyz = unit_or(tangent.xyz, vec3(0.0));
    Surface s = surface_of(m, at, normal, tangent, is_back);

    // What it sends.
    bool is_black_back = is_back && (m.flags & DOUBLE_SIDED) == 0;
    if ((m.flags & UNLIT) != 0) {
        if (path.density == 0.0 && !is_black_back) radiance[i] += base_color_of(m, at).rgb;
    } else if (s.emission != vec3(0.0)) {
        float weight = 1.0;
        if (path.density != 0.0) {
            // Density of light sampling over solid angle, from the one over area.
            float cosine = abs(dot(front, ray.direction));
            float light = params.choice.emitters * emitter_density[triangle] * hit.t * hit.t / max(cosine, 1e-12);
            weight = reflection_weight(path.density, light);
        }
        radiance[i] += weight * path.throughput * s.emission;
    }

    if (params.is_last != 0) return;
    PathVertex vertex;
    vertex.position = w.x * a + w.y * b + w.z * c;
    vertex.geometric_normal = is_back ? -front : front;
    vertex.offset = offset_length(a, b, c);
    vertex.albedo = is_black_back ? vec3(0.0) : s.albedo;
    vertex.f0 = s.f0;
    vertex.f90 = s.f90;
    vertex.alpha = s.alpha;
    vertex.normal = s.normal;
    vertex.reflects = s.reflects ? 1 : 0;
    vertices[i] = vertex;
}
