#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/bins.glsl"
#include "lib/quadtree.glsl"

// Sixteen threads per node of one level of a window: in each bin the shorter of its own link and its parent's. From the
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
    if (i >= own.count * 16) return;
    uint node = own.first + i / 16;
    QuadtreeSegment segment = segments[node_segments[node]];
    if (segment.parent_first == NO_PARENT) return;
    uint parent = quadtree_parent(segment, node);
    if (parent < above.first || parent - above.first >= above.count) return;    // the window starts here
    uint from = (above.row + parent - above.first) * params.bin_count, to = (own.row + i / 16) * params.bin_count;
    for (uint bin = i % 16; bin < params.bin_count; bin += 16) {
        uint64_t of_parent = keys[from + bin];
        if (of_parent < keys[to + bin]) keys[to + bin] = of_parent;
    }
}
