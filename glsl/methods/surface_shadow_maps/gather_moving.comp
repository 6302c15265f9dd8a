#version 460
#extension GL_EXT_nonuniform_qualifier : require
#include "lib/prelude.glsl"
#include "lib/bvh.glsl"
#include "lib/sender_gather.glsl"
#include "lib/rigid_objects.glsl"
#include "lib/sender_maps.glsl"
#include "trace/holes.glsl"

// One thread per texel: what it receives from the sender tree, seeing by the maps of objects that move, and by our own
// traversal where their hulls overlap.                                                           [Ritschel2008 3.3]
// reads texels, shapes, reflectance, the sender tree, the maps, the objects, the hierarchy and what tells its holes
// writes irradiance (W/m2), cut_sizes [texel_count]   updates arrived of shiny texels   shared none
layout(set = 0, binding = 0) uniform usamplerBuffer bvh_nodes;     // NODE_TEXELS each
layout(set = 0, binding = 1) uniform usamplerBuffer bvh_triangles; // TRIANGLE_TEXELS each, in leaf order
layout(set = 0, binding = 2, scalar) readonly buffer MapFrames { SurfaceMapFrame map_frame[]; };
layout(set = 0, binding = 17) uniform usamplerBuffer run_offsets;
layout(set = 0, binding = 18) uniform usamplerBuffer runs;
layout(set = 0, binding = 19, scalar) readonly buffer MapOrigins { vec3 map_origins[]; };      // by place, at rest
layout(set = 0, binding = 20, scalar) readonly buffer LeafMapTable { LeafMaps leaf_maps[]; };
layout(set = 0, binding = 21, scalar) readonly buffer RigidWords { uint rigid_words[]; };
layout(set = 0, binding = 22, scalar) readonly buffer RigidObjects { RigidObject rigid_objects[]; };

uvec4 bvh_node_texel(uint i) { return texelFetch(bvh_nodes, int(i)); }
uvec4 bvh_triangle_texel(uint i) { return texelFetch(bvh_triangles, int(i)); }
uvec4 surface_offset_texel(uint i) { return texelFetch(run_offsets, int(i)); }
uvec4 surface_run_texel(uint i) { return texelFetch(runs, int(i)); }
vec3 map_origin(uint place) { return map_origins[place]; }
uint rigid_word(uint i) { return rigid_words[i]; }
RigidObject rigid_object(uint i) { return rigid_objects[i]; }

float visibility(vec3 origin, vec3 target, uint leaf)
{
    uint texel = linear_index(), sender_object = rigid_word(rigid_word(RIGID_LEAF_OBJECTS) + leaf);
    uint object = rigid_word(rigid_word(RIGID_TEXEL_OBJECTS) + texel);
    if (rigid_asks_rays(object, sender_object))
        return is_hit(traverse(Ray(origin, 0.0, target - origin, 1.0), true)) ? 0.0 : 1.0;
    uint own_place = rigid_word(rigid_word(RIGID_TEXEL_PLACES) + texel);
    RigidPoint own = RigidPoint(origin, receiver.geometric, object, own_place, map_origins[own_place]);
    SenderLeaf shape = sender_shape(leaf);
    SenderPlaces asked = sender_places(map_frame[0], leaf_maps[leaf], place_on_leaf(shape, target), origin);
    float free = 0.0;
    for (uint k = 0; k < asked.count; ++k) {
        RigidPoint sender = RigidPoint(target, leaf_normal(shape), sender_object, asked.place[k], map_origins[asked.place[k]]);
        free += asked.weight[k] * rigid_visibility(map_frame[0], sender, own);
    }
    return free;
}

#include "methods/surface_shadow_maps/gather.glsl"

void main() { gather_texel(); }
