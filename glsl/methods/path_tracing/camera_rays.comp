#version 460
#include "lib/prelude.glsl"
#include "lib/random.glsl"
#include "lib/view.glsl"
#include "methods/path_tracing/path.glsl"

// One thread per path: its ray from the eye through a random place of its pixel.               [Kajiya1986 4]
// writes rays, paths, direct, indirect [path_count] (the latter two: W m^-2 sr^-1, here 0)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) writeonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Paths { Path paths[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Direct { vec3 direct[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Indirect { vec3 indirect[]; };
layout(push_constant, scalar) uniform Params { ViewInfo view; uvec2 size; Batch batch; } params;

void main()
{
    uint i = linear_index();
    if (i >= params.batch.path_count) return;

    uint pixel = pixel_of(params.batch, i);
    vec4 u = unit_interval(sample_words(pixel, sample_of(params.batch, i), CAMERA_DIMENSION, params.batch.seed));
    vec2 corner = vec2(pixel % params.size.x, pixel / params.size.x);
    rays[i] = view_ray(params.view, corner + u.xy, params.size);
    paths[i].throughput = vec3(1.0);
    paths[i].density = 0.0;
    direct[i] = vec3(0.0);
    indirect[i] = vec3(0.0);
}
