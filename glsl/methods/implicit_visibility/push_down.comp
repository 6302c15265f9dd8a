#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/bins.glsl"
#include "lib/quadtree.glsl"

// One thread per bin of the nodes of one level of a window: the shorter of its own link and its parent's. From the
// roots down, this refines the links and pushes them down at once.                            [Dong2007 4.2.3, 4.2.4]
// reads node_segments[node_count], segments, window_levels   updates keys; the level above is done   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer NodeSegments { uint node_segments[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Segments { QuadtreeSegment segments[]; };
layout(set = 0, binding = 2, scalar) readonly buffer WindowLevels { WindowLevel window_levels[]; };
layout(set = 0, binding = 3, scalar) buffer Keys { uint64_t keys[]; };
layout(push_constant, scalar) uniform Params { uint level; uint bin_count; } params;

void main()
{
    WindowLevel own = window_levels[params.level], above = window_levels[params.level + 1];
    uint i = linear_index();
    if (i >= own.count * params.bin_count) return;
    uint node = own.first + i / params.bin_count, bin = i % params.bin_count;
    QuadtreeSegment segment = segments[node_segments[node]];
    if (segment.parent_first == NO_PARENT) return;
    uint parent = quadtree_parent(segment, node);
    if (parent < above.first || parent - above.first >= above.count) return;    // the window starts here
    uint64_t of_parent = keys[(above.row + parent - above.first) * params.bin_count + bin];
    uint at = (own.row + node - own.first) * params.bin_count + bin;
    if (of_parent < keys[at]) keys[at] = of_parent;
}
