#version 460
#extension GL_EXT_nonuniform_qualifier : require
#include "lib/prelude.glsl"
#include "lib/bvh.glsl"
#include "lib/sender_gather.glsl"
#include "lib/sender_maps.glsl"
#include "trace/holes.glsl"

// One thread per pixel: gathers from the sender tree, seeing by the senders' surface shadow maps, and by our own traversal
// the environment and, where maps are checked, what they leave in doubt.                                                      [Ritschel2008 4.4]
// Differs from [Ritschel2008]: there all that the maps hold is asked of them.
// reads the G-buffer, the sender tree, the maps, the hierarchy and what tells its holes, the environment
// updates direct, indirect, gather_counts [pixel_count]   shared none
layout(constant_id = 3) const bool CHECKED = false;
layout(set = 0, binding = 0) uniform usamplerBuffer bvh_nodes;     // NODE_TEXELS each
layout(set = 0, binding = 1) uniform usamplerBuffer bvh_triangles; // TRIANGLE_TEXELS each, in leaf order
layout(set = 0, binding = 2, scalar) readonly buffer MapFrames { SurfaceMapFrame map_frame[]; };
layout(set = 0, binding = 25) uniform usamplerBuffer run_offsets;
layout(set = 0, binding = 26) uniform usamplerBuffer runs;
layout(set = 0, binding = 27, scalar) readonly buffer MapOrigins { vec3 map_origins[]; };      // by place
layout(set = 0, binding = 28, scalar) readonly buffer LeafMapTable { LeafMaps leaf_maps[]; };

uvec4 bvh_node_texel(uint i) { return texelFetch(bvh_nodes, int(i)); }
uvec4 bvh_triangle_texel(uint i) { return texelFetch(bvh_triangles, int(i)); }
uvec4 surface_offset_texel(uint i) { return texelFetch(run_offsets, int(i)); }
uvec4 surface_run_texel(uint i) { return texelFetch(runs, int(i)); }
vec3 map_origin(uint place) { return map_origins[place]; }

#include "display/final_gather.glsl"

MapView view;       // by the maps, of the last way asked; below 0 where nothing is told

// A map is as fine as its pixels, and seen from the middle of its texel: what these are too coarse for, a ray tells. Wide
// pixels see what lies close behind an edge or a thin wall: over the last stretch of the way the ray looks for that.
bool is_told(vec3 origin, vec3 target, uint leaf, out float free)
{
    SurfaceMapFrame frame = looked_after(map_frame[0], params.map_stretch);
    SenderLeaf shape = sender_shape(leaf);
    uint place = leaf_maps[leaf].place;
    if (CHECKED) {
        // A map that texels share may stand beside this one.
        vec3 d = target - origin, beside = target - map_origins[place];
        float radius_squared = max(dot(beside, beside), max(dot(shape.edge_u, shape.edge_u), dot(shape.edge_v, shape.edge_v)));
        bool is_far = dot(d, d) >= params.map_reach * params.map_reach * radius_squared;
        view = surface_map_view(asking_four(frame), place, map_origins[place], origin, receiver.geometric);
        view.seen = is_far && view_is_sure(view) ? round(view.seen) : -1.0;
    } else {
        view = leaf_view(frame, leaf_maps[leaf], place_on_leaf(shape, target), origin, receiver.geometric);
    }
    free = max(view.seen, 0.0);
    return view.seen == 0.0 || view.seen > 0.0 && params.map_stretch <= 0.0;
}

float visibility(vec3 origin, vec3 target, uint leaf)
{
    bool by_maps = leaf != NO_SENDER && view.seen >= 0.0;
    float until = by_maps ? looked_after_share(map_frame[0], view.told) : 1.0;
    return is_hit(traverse(Ray(origin, 0.0, target - origin, until), true)) ? 0.0 : by_maps ? view.seen : 1.0;
}

void keep(Arrival arrival, float free) {}

void main() { gather_pixel(); }
