#version 460
#extension GL_EXT_nonuniform_qualifier : require
#include "lib/prelude.glsl"
#include "lib/bvh.glsl"
#include "lib/sender_gather.glsl"
#include "lib/sender_maps.glsl"
#include "trace/holes.glsl"

// One thread per texel: what it receives from the sender tree, seeing by the senders' maps, and by our own
// traversal over the last stretch of what they see.                                              [Ritschel2008 4.3]
// Differs from [Ritschel2008]: there maps alone are asked.
// reads texels, shapes, reflectance, the sender tree, the maps, the hierarchy and what tells its holes
// writes irradiance (W/m2), cut_sizes [texel_count]   updates arrived of shiny texels   shared none
layout(set = 0, binding = 0) uniform usamplerBuffer bvh_nodes;     // NODE_TEXELS each
layout(set = 0, binding = 1) uniform usamplerBuffer bvh_triangles; // TRIANGLE_TEXELS each, in leaf order
layout(set = 0, binding = 2, scalar) readonly buffer MapFrames { SurfaceMapFrame map_frame[]; };
layout(set = 0, binding = 17) uniform usamplerBuffer run_offsets;
layout(set = 0, binding = 18) uniform usamplerBuffer runs;
layout(set = 0, binding = 19, scalar) readonly buffer MapOrigins { vec3 map_origins[]; };      // by place
layout(set = 0, binding = 20, scalar) readonly buffer LeafMapTable { LeafMaps leaf_maps[]; };

uvec4 bvh_node_texel(uint i) { return texelFetch(bvh_nodes, int(i)); }
uvec4 bvh_triangle_texel(uint i) { return texelFetch(bvh_triangles, int(i)); }
uvec4 surface_offset_texel(uint i) { return texelFetch(run_offsets, int(i)); }
uvec4 surface_run_texel(uint i) { return texelFetch(runs, int(i)); }
vec3 map_origin(uint place) { return map_origins[place]; }

float visibility(vec3 origin, vec3 target, uint leaf);

#include "methods/surface_shadow_maps/gather.glsl"

float visibility(vec3 origin, vec3 target, uint leaf)
{
    SurfaceMapFrame frame = looked_after(map_frame[0], params.map_stretch);
    vec2 at = place_on_leaf(sender_shape(leaf), target);
    MapView view = leaf_view(frame, leaf_maps[leaf], at, origin, receiver.geometric);
    if (view.seen <= 0.0 || params.map_stretch <= 0.0) return view.seen;
    return is_hit(traverse(Ray(origin, 0.0, target - origin, looked_after_share(frame, view.told)), true)) ? 0.0 : view.seen;
}

void main() { gather_texel(); }
