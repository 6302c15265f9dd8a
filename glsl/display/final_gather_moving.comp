#version 460
#extension GL_EXT_nonuniform_qualifier : require
#include "lib/prelude.glsl"
#include "lib/bvh.glsl"
#include "lib/sender_gather.glsl"
#include "lib/rigid_objects.glsl"
#include "lib/sender_maps.glsl"
#include "trace/holes.glsl"

// One thread per pixel: gathers from the sender tree, seeing by the maps of objects that move; by our own traversal what
// stands close by or is in doubt, where their hulls overlap, and the environment.                                              [Ritschel2008 3.3, 4.4]
// reads the G-buffer, the sender tree, the maps, the objects, the hierarchy and what tells its holes, the environment
// updates direct, indirect, gather_counts [pixel_count]   shared none
layout(constant_id = 3) const bool CHECKED = false;
layout(set = 0, binding = 0) uniform usamplerBuffer bvh_nodes;     // NODE_TEXELS each
layout(set = 0, binding = 1) uniform usamplerBuffer bvh_triangles; // TRIANGLE_TEXELS each, in leaf order
layout(set = 0, binding = 2, scalar) readonly buffer MapFrames { SurfaceMapFrame map_frame[]; };
layout(set = 0, binding = 25) uniform usamplerBuffer run_offsets;
layout(set = 0, binding = 26) uniform usamplerBuffer runs;
layout(set = 0, binding = 27, scalar) readonly buffer MapOrigins { vec3 map_origins[]; };      // by place, at rest
layout(set = 0, binding = 28, scalar) readonly buffer LeafMapTable { LeafMaps leaf_maps[]; };
layout(set = 0, binding = 30, scalar) readonly buffer RigidWords { uint rigid_words[]; };
layout(set = 0, binding = 31, scalar) readonly buffer RigidObjects { RigidObject rigid_objects[]; };

uvec4 bvh_node_texel(uint i) { return texelFetch(bvh_nodes, int(i)); }
uvec4 bvh_triangle_texel(uint i) { return texelFetch(bvh_triangles, int(i)); }
uvec4 surface_offset_texel(uint i) { return texelFetch(run_offsets, int(i)); }
uvec4 surface_run_texel(uint i) { return texelFetch(runs, int(i)); }
vec3 map_origin(uint place) { return map_origins[place]; }
uint rigid_word(uint i) { return rigid_words[i]; }
RigidObject rigid_object(uint i) { return rigid_objects[i]; }

#include "display/final_gather.glsl"

bool is_told(vec3 origin, vec3 target, uint leaf, out float free)
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    uint triangle = texelFetch(visible_triangles, pixel, 0).x - 1;
    uint object = rigid_word(rigid_word(RIGID_TRIANGLE_OBJECTS) + triangle);
    uint sender_object = rigid_word(rigid_word(RIGID_LEAF_OBJECTS) + leaf);
    vec2 b = vec2(texelFetch(g_position, pixel, 0).w, texelFetch(g_specular, pixel, 0).w);
    uvec3 v = triangles[triangle];
    bool is_back = dot(cross(positions[v.y] - positions[v.x], positions[v.z] - positions[v.x]), receiver.geometric) < 0.0;
    uint texel = rigid_texel(triangle, vec3(1.0 - b.x - b.y, b), is_back);
    SenderLeaf shape = sender_shape(leaf);
    // A map that texels share may stand beside this one.
    vec3 d = target - origin, beside = at_rest(rigid_object(sender_object), target) - map_origins[leaf_maps[leaf].place];
    float radius_squared = max(dot(beside, beside), max(dot(shape.edge_u, shape.edge_u), dot(shape.edge_v, shape.edge_v)));
    bool is_near = CHECKED && dot(d, d) < params.map_reach * params.map_reach * radius_squared;
    free = 0.0;
    if (texel == NO_SENDER || rigid_asks_rays(object, sender_object) || is_near) return false;
    uint own_place = rigid_word(rigid_word(RIGID_TEXEL_PLACES) + texel);
    RigidPoint own = RigidPoint(origin, receiver.geometric, object, own_place, map_origins[own_place]);
    if (CHECKED) {
        uint place = leaf_maps[leaf].place;
        RigidPoint sender = RigidPoint(target, leaf_normal(shape), sender_object, place, map_origins[place]);
        bool is_free, is_sure = rigid_is_sure(map_frame[0], sender, own, is_free);
        free = is_free ? 1.0 : 0.0;
        return is_sure;
    }
    SenderPlaces asked = sender_places(map_frame[0], leaf_maps[leaf], place_on_leaf(shape, target), origin);
    for (uint k = 0; k < asked.count; ++k) {
        RigidPoint sender = RigidPoint(target, leaf_normal(shape), sender_object, asked.place[k], map_origins[asked.place[k]]);
        free += asked.weight[k] * rigid_visibility(map_frame[0], sender, own);
    }
    return true;
}

float visibility(vec3 origin, vec3 target, uint leaf)
{
    return is_hit(traverse(Ray(origin, 0.0, target - origin, 1.0), true)) ? 0.0 : 1.0;
}

void keep(Arrival arrival, float free) {}

void main() { gather_pixel(); }
