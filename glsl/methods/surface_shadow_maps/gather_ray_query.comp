#version 460
#extension GL_EXT_nonuniform_qualifier : require
#extension GL_EXT_ray_query : require
#include "lib/prelude.glsl"
#include "lib/ray.glsl"
#include "trace/holes.glsl"

// One thread per texel: what it receives from the sender tree, seeing by the driver's traversal.  [Ritschel2008 4.3]
// reads texels, shapes, reflectance, the sender tree, the acceleration structure and what tells holes
// writes irradiance (W/m2), cut_sizes [texel_count]   updates arrived of shiny texels   shared none
layout(set = 0, binding = 0) uniform accelerationStructureEXT acceleration_structure;

#include "trace/free_way_ray_query.glsl"
#include "methods/surface_shadow_maps/gather.glsl"

void main() { gather_texel(); }
