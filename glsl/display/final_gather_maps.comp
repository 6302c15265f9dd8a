#version 460
#extension GL_EXT_nonuniform_qualifier : require
#include "lib/prelude.glsl"
#include "lib/bvh.glsl"
#include "lib/sender_gather.glsl"
#include "lib/sender_maps.glsl"
#include "trace/holes.glsl"

// One thread per pixel: gathers from the sender tree, seeing by the senders' surface shadow maps, and from the
// environment, seeing by our own traversal.                                                      [Ritschel2008 4.4]
// reads the G-buffer, the sender tree, the maps, the hierarchy and what tells its holes, the environment
// updates direct, indirect, gather_counts [pixel_count]   shared none
layout(set = 0, binding = 0) uniform usamplerBuffer bvh_nodes;     // NODE_TEXELS each
layout(set = 0, binding = 1) uniform usamplerBuffer bvh_triangles; // TRIANGLE_TEXELS each, in leaf order
layout(set = 0, binding = 2, scalar) readonly buffer MapFrames { SurfaceMapFrame map_frame[]; };
layout(set = 0, binding = 25, scalar) readonly buffer RunOffsets { uint run_offsets[]; };
layout(set = 0, binding = 26, scalar) readonly buffer Runs { uint runs[]; };
layout(set = 0, binding = 27, scalar) readonly buffer MapOrigins { vec3 map_origins[]; };      // by place
layout(set = 0, binding = 28, scalar) readonly buffer LeafPlaces { uint leaf_places[]; };
layout(set = 0, binding = 30, scalar) readonly buffer LeafNeighbours { uvec4 leaf_neighbours[]; };   // their places

uvec4 bvh_node_texel(uint i) { return texelFetch(bvh_nodes, int(i)); }
uvec4 bvh_triangle_texel(uint i) { return texelFetch(bvh_triangles, int(i)); }
uint surface_run_offset(uint pixel) { return run_offsets[pixel]; }
uint surface_run(uint index) { return runs[index]; }
vec3 surface_map_origin(uint place) { return map_origins[place]; }

float visibility(vec3 origin, vec3 target, uint leaf)
{
    if (leaf == NO_SENDER) return is_hit(traverse(Ray(origin, 0.0, target - origin, 1.0), true)) ? 0.0 : 1.0;
    vec2 at = place_on_leaf(sender_shape(leaf), target);
    return sender_maps_visibility(map_frame[0], leaf_places[leaf], leaf_neighbours[leaf], at, origin, receiver.geometric);
}

#include "display/final_gather.glsl"

void main() { gather_pixel(); }
