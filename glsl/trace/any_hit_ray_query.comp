#version 460
#extension GL_EXT_nonuniform_qualifier : require
#extension GL_EXT_ray_query : require
#include "lib/prelude.glsl"
#include "lib/ray.glsl"
#include "trace/holes.glsl"

// One thread per ray: is its whole length free? By the driver's traversal; of several hits at one t it may report any.
// reads acceleration_structure, rays[ray_count], the tables of trace/holes   writes visibility[ray_count]: 1 free, 0 blocked   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform accelerationStructureEXT acceleration_structure;

#include "trace/free_ray_query.glsl"

layout(set = 0, binding = 2, scalar) readonly buffer Rays        { Ray rays[]; };                  // ray_count
layout(set = 0, binding = 7, scalar) writeonly buffer Visibility { uint visibility[]; };             // ray_count
layout(push_constant, scalar) uniform Params { uint ray_count; } params;

void main()
{
    uint i = linear_index();
    if (i >= params.ray_count) return;
    visibility[i] = is_free(rays[i]) ? 1 : 0;
}
