#version 460
#extension GL_EXT_nonuniform_qualifier : require
#extension GL_EXT_ray_query : require
#include "lib/prelude.glsl"
#include "lib/ray.glsl"
#include "trace/holes.glsl"

// One thread per pixel: what every display stage starts from: background, emission, punctual light, and what is seen
// there. The stage adds all other light. Rays are cast by the driver's traversal.
// reads the G-buffer, triangles, positions, lights, shadow maps, the environment, the acceleration structure and what
// tells holes   updates direct, indirect, albedo, normal, depth [pixel_count]   shared none
layout(set = 0, binding = 0) uniform accelerationStructureEXT acceleration_structure;

#include "trace/free_ray_query.glsl"
#include "display/direct.glsl"

void main() { shade_pixel(); }
