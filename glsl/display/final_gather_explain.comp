#version 460
#extension GL_EXT_nonuniform_qualifier : require
#include "lib/prelude.glsl"
#include "lib/bvh.glsl"
#include "trace/holes.glsl"

// As display/final_gather, and one pixel keeps what it takes from each sender.                    [Ritschel2008 4.4]
// reads the G-buffer, the sender tree, the hierarchy and what tells its holes, the environment
// updates direct, indirect, gather_counts [pixel_count], kept   shared none
layout(constant_id = 1) const bool SEES_THROUGH = false;
layout(set = 0, binding = 0) uniform usamplerBuffer bvh_nodes;     // NODE_TEXELS each
layout(set = 0, binding = 1) uniform usamplerBuffer bvh_triangles; // TRIANGLE_TEXELS each, in leaf order

// What one sender brought. The first of the table is its head: the pixel as leaf, and how many follow as sample.
struct KeptSender {
    uint leaf;              // slot of the tree, NO_SENDER: the environment
    uint sample_index;
    vec3 direct;            // W m^-2 sr^-1, of the sample
    vec3 indirect;
};
layout(set = 0, binding = 25, scalar) buffer Kept { KeptSender kept[]; };

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

void keep(Arrival arrival, float free)
{
    if (gathered_pixel != kept[0].leaf || free <= 0.0) return;
    // One thread of one dispatch at a time: no two write here.
    uint count = ++kept[0].sample_index;
    if (count < kept.length()) kept[count] = KeptSender(arrival.leaf, params.sample_index, free * arrival.direct, free * arrival.indirect);
}

void main() { gather_pixel(); }
