#version 460
#include "lib/prelude.glsl"
#include "lib/quadtree.glsl"

// One thread per node of one level: a leaf takes its element's radiosity, an inner node the area-weighted mean of its
// children's.                                                                                      [Dong2007 4.3]
// reads node_segments[node_count], segments, surfels[node_count], leaf_elements[leaf_count], radiosity[element_count] (W/m2)
// updates node_radiosity[node_count] (W/m2); the level below is done   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer NodeSegments { uint node_segments[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Segments { QuadtreeSegment segments[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Surfels { Surfel surfels[]; };
layout(set = 0, binding = 3, scalar) readonly buffer LeafElements { uint leaf_elements[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Radiosity { vec3 radiosity[]; };
layout(set = 0, binding = 5, scalar) buffer NodeRadiosity { vec3 node_radiosity[]; };
layout(push_constant, scalar) uniform Params { uint first; uint count; } params;

void main()
{
    uint i = linear_index();
    if (i >= params.count) return;
    uint node = params.first + i;
    QuadtreeSegment segment = segments[node_segments[node]];
    if (segment.level == 0) {
        node_radiosity[node] = radiosity[leaf_elements[node]];
        return;
    }
    uvec2 children = quadtree_children(segment, node);
    vec3 sum = vec3(0.0);
    float area = 0.0;
    for (uint k = children.x; k < children.x + children.y; ++k) {
        sum += surfels[k].area * node_radiosity[k];
        area += surfels[k].area;
    }
    node_radiosity[node] = area > 0.0 ? sum / area : vec3(0.0);
}
