#version 460
#extension GL_EXT_nonuniform_qualifier : require
#include "lib/prelude.glsl"
#include "lib/bvh.glsl"
#include "trace/holes.glsl"

// One thread per pixel: gathers from the sender tree and the environment, seeing by our own traversal, or through
// everything.                                                                                    [Ritschel2008 4.4]
// reads the G-buffer, the sender tree, the hierarchy and what tells its holes, the environment
// updates direct, indirect, gather_counts [pixel_count]   shared none
layout(constant_id = 1) const bool SEES_THROUGH = false;
layout(set = 0, binding = 0) uniform usamplerBuffer bvh_nodes;     // NODE_TEXELS each
layout(set = 0, binding = 1) uniform usamplerBuffer bvh_triangles; // TRIANGLE_TEXELS each, in leaf order

uvec4 bvh_node_texel(uint i) { return texelFetch(bvh_nodes, int(i)); }
uvec4 bvh_triangle_texel(uint i) { return texelFetch(bvh_triangles, int(i)); }

bool is_told(vec3 origin, vec3 target, uint leaf, out float free)
{
    free = 1.0;
    return SEES_THROUGH;
}

float visibility(vec3 origin, vec3 target, uint leaf)
{
    if (SEES_THROUGH) return 1.0;
    return is_hit(traverse(Ray(origin, 0.0, target - origin, 1.0), true)) ? 0.0 : 1.0;
}

#include "display/final_gather.glsl"

void keep(Arrival arrival, float free) {}

void main() { gather_pixel(); }
