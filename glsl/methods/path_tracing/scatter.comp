#version 460
#include "lib/prelude.glsl"
#include "lib/brdf.glsl"
#include "lib/random.glsl"
#include "lib/ray.glsl"
#include "methods/path_tracing/path.glsl"

// One thread per path: takes what its free shadow ray brings, and goes on in a direction drawn from the reflection.
//                                                                                              [Kajiya1986 4]
// reads vertices, visibility, connections [path_count]   updates rays, paths, radiance [path_count] (W m^-2 sr^-1)
// shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Vertices { PathVertex vertices[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Visibility { uint visibility[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Connections { vec3 connections[]; };
layout(set = 0, binding = 3, scalar) buffer Rays { Ray rays[]; };
layout(set = 0, binding = 4, scalar) buffer Paths { Path paths[]; };
layout(set = 0, binding = 5, scalar) buffer Radiance { vec3 radiance[]; };
layout(push_constant, scalar) uniform Params { Batch batch; uint depth; } params;

void main()
{
    uint i = linear_index();
    if (i >= params.batch.path_count) return;

    if (visibility[i] != 0) radiance[i] += connections[i];
    PathVertex vertex = vertices[i];
    vec3 to_eye = -rays[i].direction;
    rays[i].t_max = -1.0;
    if (vertex.reflects == 0) return;

    uint pixel = pixel_of(params.batch, i), dimension = reflection_dimension(params.depth);
    vec4 u = unit_interval(sample_words(pixel, sample_of(params.batch, i), dimension, params.batch.seed));
    Surface s = surface_at(vertex);
    vec3 direction = brdf_sample(s, to_eye, u.z, u.xy);
    float length_squared = dot(direction, direction);
    direction /= sqrt(length_squared);
    float density = brdf_density(s, to_eye, direction);
    float cosine = dot(s.normal, direction);
    if (density <= 0.0 || cosine <= 0.0 || dot(vertex.geometric_normal, direction) <= 0.0) return;

    vec3 throughput = paths[i].throughput * brdf_value(s, to_eye, direction) * (cosine / density);
    if (throughput == vec3(0.0)) return;
    paths[i].throughput = throughput;
    paths[i].density = density;
    rays[i].origin = vertex.position + vertex.offset * vertex.geometric_normal;
    rays[i].t_min = 0.0;
    rays[i].direction = direction;
    rays[i].t_max = 1e30;
}
