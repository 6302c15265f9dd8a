#version 460
#include "lib/prelude.glsl"
#include "lib/bins.glsl"
#include "lib/quadtree.glsl"
#include "methods/implicit_visibility/horizon.glsl"
#include "methods/implicit_visibility/link_texels.glsl"

// One thread per node: what the making of links looks at, beside each other in texels.             [Dong2007 4.2.2]
// reads surfels, moments [node_count], leaf_cells, receivers [leaf_count]
// writes sender_texels[SENDER_TEXELS * node_count], receiver_texels[RECEIVER_TEXELS * node_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Surfels { Surfel surfels[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Moments { SurfelMoments moments[]; };
layout(set = 0, binding = 2, scalar) readonly buffer LeafCells { LeafCell leaf_cells[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Receivers { Receiver receivers[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer SenderTexels { uvec4 sender_texels[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer ReceiverTexels { uvec4 receiver_texels[]; };
layout(push_constant, scalar) uniform Params { uint node_count; uint leaf_count; } params;

void main()
{
    uint node = linear_index();
    if (node >= params.node_count) return;
    Surfel s = surfels[node];
    bool is_leaf = node < params.leaf_count;

    // Of the ellipse where g1 and g2 are 1.
    vec3 along = cross(s.g2, s.normal), across = cross(s.normal, s.g1);
    float inverse = dot(s.g1, along);
    inverse = inverse != 0.0 ? 1.0 / inverse : 0.0;
    vec3 first = inverse * along, second = inverse * across, vertex = vec3(0.0);
    uvec2 corners = uvec2(0);
    if (is_leaf) {
        LeafCell cell = leaf_cells[node];
        corners = uvec2(cell.first_corner, 4 * cell.corner_count + cell.sides);
        vertex = cell.vertex;
        vec3 offset = vertex - s.centre;
        if (is_flat(s.thickness, s.radius)) vertex = vec3(dot(s.g1, offset), dot(s.g2, offset), 0.0);
    } else if (!has_plane(s.cos_cone)) {
        SurfelMoments m = moments[node];
        first = m.diagonal;
        second = m.mixed;
        vertex = s.area > 0.0 ? m.across / s.area : vec3(0.0);
    }
    uint to = SENDER_TEXELS * node;
    sender_texels[to] = floatBitsToUint(vec4(s.centre, s.radius));
    sender_texels[to + 1] = floatBitsToUint(vec4(s.normal, s.thickness));
    sender_texels[to + 2] = uvec4(floatBitsToUint(first), corners.x);
    sender_texels[to + 3] = uvec4(floatBitsToUint(second), corners.y);
    sender_texels[to + 4] = uvec4(floatBitsToUint(vertex), 0);

    // A leaf receives at one point with one normal.
    Receiver at = Receiver(s.centre, s.normal, vec4(0.0, 0.0, 0.0, 1.0));
    if (is_leaf) at = receivers[node];
    vec2 bounds = is_leaf ? vec2(0.0, 1.0) : vec2(reach_above(s.cos_cone, s.radius, s.thickness), s.cos_cone);
    to = RECEIVER_TEXELS * node;
    receiver_texels[to] = floatBitsToUint(vec4(at.origin, bounds.x));
    receiver_texels[to + 1] = floatBitsToUint(vec4(at.normal, bounds.y));
    receiver_texels[to + 2] = floatBitsToUint(at.frame);
}
