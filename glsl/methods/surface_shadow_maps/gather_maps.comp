#version 460
#include "lib/prelude.glsl"
#include "lib/sender_gather.glsl"
#include "lib/sender_maps.glsl"

// One thread per texel: what it receives from the sender tree, seeing by the senders' maps.      [Ritschel2008 4.3]
// reads texels, shapes, reflectance, the sender tree, the maps
// writes irradiance (W/m2), cut_sizes [texel_count]   updates arrived of shiny texels   shared none
layout(set = 0, binding = 0) uniform usamplerBuffer run_offsets;
layout(set = 0, binding = 1) uniform usamplerBuffer runs;
layout(set = 0, binding = 2, scalar) readonly buffer MapOrigins { vec3 map_origins[]; };       // by place
layout(set = 0, binding = 3, scalar) readonly buffer LeafMapTable { LeafMaps leaf_maps[]; };
layout(set = 0, binding = 4, scalar) readonly buffer MapFrames { SurfaceMapFrame map_frame[]; };

uvec4 surface_offset_texel(uint i) { return texelFetch(run_offsets, int(i)); }
uvec4 surface_run_texel(uint i) { return texelFetch(runs, int(i)); }

float visibility(vec3 origin, vec3 target, uint leaf)
{
    vec2 at = place_on_leaf(sender_shape(leaf), target);
    SenderPlaces asked = sender_places(map_frame[0], leaf_maps[leaf], at, origin);
    float free = 0.0;
    for (uint k = 0; k < asked.count; ++k)
        free += asked.weight[k] * surface_map_visibility(map_frame[0], asked.place[k], map_origins[asked.place[k]], origin, receiver.geometric);
    return free;
}

#include "methods/surface_shadow_maps/gather.glsl"

void main() { gather_texel(); }
