#version 460
#include "lib/prelude.glsl"
#include "lib/element.glsl"
#include "lib/quadtree.glsl"

// One thread per (node above glossy leaves of one level, direction): the area-weighted mean of what its children send there.
// reads glossy_nodes, glossy_of_node[node_count], node_segments, segments, surfels   updates specular[glossy node * directions]
// (W m^-2 sr^-1); the level below is done   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer GlossyNodes { uint glossy_nodes[]; };
layout(set = 0, binding = 1, scalar) readonly buffer GlossyOfNode { uint glossy_of_node[]; };
layout(set = 0, binding = 2, scalar) readonly buffer NodeSegments { uint node_segments[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Segments { QuadtreeSegment segments[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Surfels { Surfel surfels[]; };
layout(set = 0, binding = 5, scalar) buffer Specular { vec3 specular[]; };
layout(push_constant, scalar) uniform Params { uint first; uint count; uint directions; } params;

void main()
{
    uint i = linear_index();
    if (i >= params.count * params.directions) return;
    uint glossy = params.first + i / params.directions, direction = i % params.directions;
    uint node = glossy_nodes[glossy];
    uvec2 children = quadtree_children(segments[node_segments[node]], node);
    vec3 sum = vec3(0.0);
    float area = 0.0;
    for (uint k = children.x; k < children.x + children.y; ++k) {
        area += surfels[k].area;
        if (glossy_of_node[k] != NO_ELEMENT) sum += surfels[k].area * specular[glossy_of_node[k] * params.directions + direction];
    }
    specular[glossy * params.directions + direction] = area > 0.0 ? sum / area : vec3(0.0);
}
