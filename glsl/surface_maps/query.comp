#version 460
#include "lib/prelude.glsl"
#include "lib/surface_map.glsl"

// One thread per query: whether the texel at a place of the sequence sees a point.               [Ritschel2008 3.2]
// reads queries[query_count], map_origins[place_count] (m), run_offsets, runs   writes visibility[query_count] (0..1)   shared none
struct SurfaceMapQuery {
    vec3 point;     // metres
    vec3 normal;    // unit, of the surface there
    uint place;
};
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Queries { SurfaceMapQuery queries[]; };
layout(set = 0, binding = 1, scalar) readonly buffer MapOrigins { vec3 map_origins[]; };
layout(set = 0, binding = 2) uniform usamplerBuffer run_offsets;
layout(set = 0, binding = 3) uniform usamplerBuffer runs;
layout(set = 0, binding = 4, scalar) writeonly buffer Visibility { float visibility[]; };
layout(push_constant, scalar) uniform Params { uint query_count; SurfaceMapFrame frame; } params;

uvec4 surface_offset_texel(uint i) { return texelFetch(run_offsets, int(i)); }
uvec4 surface_run_texel(uint i) { return texelFetch(runs, int(i)); }

void main()
{
    uint i = linear_index();
    if (i >= params.query_count) return;
    uint place = queries[i].place;
    visibility[i] = surface_map_view(params.frame, place, map_origins[place], queries[i].point, queries[i].normal).seen;
}
