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
layout(set = 0, binding = 2, scalar) readonly buffer RunOffsets { uint run_offsets[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Runs { uint runs[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer Visibility { float visibility[]; };
layout(push_constant, scalar) uniform Params { uint query_count; SurfaceMapFrame frame; } params;

uint surface_run_offset(uint pixel) { return run_offsets[pixel]; }
uint surface_run(uint index) { return runs[index]; }

void main()
{
    uint i = linear_index();
    if (i >= params.query_count) return;
    uint place = queries[i].place;
    visibility[i] = surface_map_visibility(params.frame, place, map_origins[place], queries[i].point, queries[i].normal);
}
