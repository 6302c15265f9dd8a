#version 460
#include "lib/prelude.glsl"
#include "lib/atlas.glsl"
#include "lib/rigid_objects.glsl"

// One thread per pair of texels: whether they see each other, by the maps of objects that move.   [Ritschel2008 3.3]
// reads pairs[pair_count] (sender, receiver), texels, map_origins (at rest), the maps, the objects
// writes visibility[pair_count] (0..1; -1 where rays must be asked)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Pairs { uvec2 pairs[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Texels { AtlasTexel texels[]; };
layout(set = 0, binding = 2, scalar) readonly buffer MapOrigins { vec3 map_origins[]; };
layout(set = 0, binding = 3) uniform usamplerBuffer run_offsets;
layout(set = 0, binding = 4) uniform usamplerBuffer runs;
layout(set = 0, binding = 5, scalar) readonly buffer RigidWords { uint rigid_words[]; };
layout(set = 0, binding = 6, scalar) readonly buffer RigidObjects { RigidObject rigid_objects[]; };
layout(set = 0, binding = 7, scalar) writeonly buffer Visibility { float visibility[]; };
layout(push_constant, scalar) uniform Params { uint pair_count; SurfaceMapFrame frame; } params;

uvec4 surface_offset_texel(uint i) { return texelFetch(run_offsets, int(i)); }
uvec4 surface_run_texel(uint i) { return texelFetch(runs, int(i)); }
uint rigid_word(uint i) { return rigid_words[i]; }
RigidObject rigid_object(uint i) { return rigid_objects[i]; }

RigidPoint point_of(uint texel)
{
    uint place = rigid_word(rigid_word(RIGID_TEXEL_PLACES) + texel);
    uint object = rigid_word(rigid_word(RIGID_TEXEL_OBJECTS) + texel);
    return RigidPoint(texels[texel].position, texels[texel].normal, object, place, map_origins[place]);
}

void main()
{
    uint i = linear_index();
    if (i >= params.pair_count) return;
    RigidPoint sender = point_of(pairs[i].x), receiver = point_of(pairs[i].y);
    visibility[i] = rigid_asks_rays(receiver.object, sender.object) ? -1.0 : rigid_visibility(params.frame, sender, receiver);
}
