#version 460
#include "lib/prelude.glsl"
#include "lib/ray.glsl"
#include "surface_maps/pixel_ray.glsl"

// One thread per pixel of the cube maps of a chunk: its ray; none below the surface.             [Ritschel2008 3.2]
// reads map_origins, map_normals [place_count] (m, unit)   writes rays[chunk_count * 6 * resolution^2]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer MapOrigins { vec3 map_origins[]; };
layout(set = 0, binding = 1, scalar) readonly buffer MapNormals { vec3 map_normals[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Rays { Ray rays[]; };
layout(push_constant, scalar) uniform Params { uint first_place; uint chunk_count; uint resolution; } params;

void main()
{
    uint i = linear_index();
    uint pixel_count = 6 * params.resolution * params.resolution;
    if (i >= params.chunk_count * pixel_count) return;

    uint place = params.first_place + i / pixel_count;
    vec3 direction;
    bool is_asked = map_pixel_ray(i % pixel_count, params.resolution, map_normals[place], direction);
    rays[i] = Ray(map_origins[place], 0.0, direction, is_asked ? 3e38 : -1.0);
}
