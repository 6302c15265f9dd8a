#version 460
#extension GL_EXT_nonuniform_qualifier : require
#include "lib/prelude.glsl"
#include "lib/bvh.glsl"
#include "trace/holes.glsl"

// One thread per pixel: what every display stage starts from: background, emission, punctual light, and what is seen
// there. The stage adds all other light. Rays are cast by our own traversal.
// reads the G-buffer, triangles, positions, lights, shadow maps, the environment, the hierarchy and what tells its holes
// updates direct, indirect, albedo, normal, depth [pixel_count]   shared none
layout(set = 0, binding = 0) uniform usamplerBuffer bvh_nodes;     // NODE_TEXELS each
layout(set = 0, binding = 1) uniform usamplerBuffer bvh_triangles; // TRIANGLE_TEXELS each, in leaf order

uvec4 bvh_node_texel(uint i) { return texelFetch(bvh_nodes, int(i)); }
uvec4 bvh_triangle_texel(uint i) { return texelFetch(bvh_triangles, int(i)); }

bool is_free(Ray ray) { return !is_hit(traverse(ray, true)); }

#include "display/direct.glsl"

void main() { shade_pixel(); }
