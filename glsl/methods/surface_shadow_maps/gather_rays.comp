#version 460
#extension GL_EXT_nonuniform_qualifier : require
#include "lib/prelude.glsl"
#include "lib/bvh.glsl"
#include "trace/holes.glsl"

// One thread per texel: what it receives from the sender tree, seeing by our own traversal.      [Ritschel2008 4.3]
// reads texels, shapes, reflectance, the sender tree, the hierarchy and what tells its holes
// writes irradiance (W/m2), cut_sizes [texel_count]   updates arrived of shiny texels   shared none
layout(set = 0, binding = 0) uniform usamplerBuffer bvh_nodes;     // NODE_TEXELS each
layout(set = 0, binding = 1) uniform usamplerBuffer bvh_triangles; // TRIANGLE_TEXELS each, in leaf order

uvec4 bvh_node_texel(uint i) { return texelFetch(bvh_nodes, int(i)); }
uvec4 bvh_triangle_texel(uint i) { return texelFetch(bvh_triangles, int(i)); }

float visibility(vec3 origin, vec3 target, uint leaf)
{
    return is_hit(traverse(Ray(origin, 0.0, target - origin, 1.0), true)) ? 0.0 : 1.0;
}

#include "methods/surface_shadow_maps/gather.glsl"

void main() { gather_texel(); }
