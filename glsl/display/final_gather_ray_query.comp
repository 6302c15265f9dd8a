#version 460
#extension GL_EXT_nonuniform_qualifier : require
#extension GL_EXT_ray_query : require
#include "lib/prelude.glsl"
#include "lib/ray.glsl"
#include "trace/holes.glsl"

// One thread per pixel: gathers from the sender tree and the environment, seeing by the driver's traversal.
//                                                                                               [Ritschel2008 4.4]
// reads the G-buffer, the sender tree, the acceleration structure and what tells holes, the environment
// updates direct, indirect, gather_counts [pixel_count]   shared none
layout(set = 0, binding = 0) uniform accelerationStructureEXT acceleration_structure;

#include "trace/free_way_ray_query.glsl"
#include "display/final_gather.glsl"

bool is_told(vec3 origin, vec3 target, uint leaf, out float free)
{
    free = 0.0;
    return false;
}

void keep(Arrival arrival, float free) {}

void main() { gather_pixel(); }
