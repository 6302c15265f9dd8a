#version 460
#include "lib/prelude.glsl"
#include "lib/quadtree.glsl"

// One thread per step of the walk: its node's surfel beside it, for kernels that walk.             [Dong2007 4.2.1]
// reads walk, surfels [node_count]   writes walk_texels[WALK_TEXELS * node_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Walk { WalkStep walk[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Surfels { Surfel surfels[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer WalkTexels { uvec4 walk_texels[]; };
layout(push_constant, scalar) uniform Params { uint node_count; } params;

void main()
{
    uint k = linear_index();
    if (k >= params.node_count) return;
    WalkStep at = walk[k];
    Surfel s = surfels[at.node];
    walk_texels[WALK_TEXELS * k] = floatBitsToUint(vec4(s.centre, s.radius));
    walk_texels[WALK_TEXELS * k + 1] = floatBitsToUint(vec4(s.normal, s.extent));
    walk_texels[WALK_TEXELS * k + 2] = uvec4(at.node, at.skip, floatBitsToUint(vec2(s.thickness, s.cos_cone)));
}
