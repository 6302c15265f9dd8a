#version 460
#include "lib/prelude.glsl"
#include "lib/bins.glsl"
#include "lib/quadtree.glsl"
#include "lib/surfel.glsl"
#include "methods/implicit_visibility/horizon.glsl"
#include "methods/implicit_visibility/link_texels.glsl"

// One thread per node: what the making of links looks at, beside each other in texels.             [Dong2007 4.2.2]
// reads surfels, moments, node_segments [node_count], segments, leaf_cells, receivers [leaf_count]
// writes sender_texels[SENDER_TEXELS * node_count], receiver_texels[RECEIVER_TEXELS * node_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Surfels { Surfel surfels[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Moments { SurfelMoments moments[]; };
layout(set = 0, binding = 2, scalar) readonly buffer LeafCells { LeafCell leaf_cells[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Receivers { Receiver receivers[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer SenderTexels { uvec4 sender_texels[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer ReceiverTexels { uvec4 receiver_texels[]; };
layout(set = 0, binding = 6, scalar) readonly buffer NodeSegments { uint node_segments[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Segments { QuadtreeSegment segments[]; };
layout(push_constant, scalar) uniform Params { uint node_count; uint leaf_count; } params;

// How far a child reaches from its centre, in standard deviations of its points: the side of a rectangle lies sqrt(3) of
// them away, and the rims of leaves' cells are ragged.
const float CHILD_REACH = 1.85;

// The parallelogram that holds a node's children, along the cut between the first two and the others: leaves of a mesh in
// rows fill it, and nothing beyond an edge of the mesh is taken for them. `axes` are half axes of the node's ellipse, dual
// to g1 and g2, and become those of the ellipse through the corners; the middle's offset from the node's centre.
vec3 bound_children(uint node, Surfel s, inout vec3 axes[2])
{
    uvec2 children = quadtree_children(segments[node_segments[node]], node);
    vec3 sides[2] = vec3[](vec3(0.0), vec3(0.0));
    float counts[2] = float[](0.0, 0.0);
    for (uint k = 0; k < children.y; ++k) {
        uint side = children.y > 2 ? k / 2 : k;
        sides[side] += surfels[children.x + k].centre - s.centre;
        counts[side] += 1.0;
    }
    vec3 cut = sides[1] / max(counts[1], 1.0) - sides[0] / counts[0];
    vec2 along = vec2(dot(s.g1, cut), dot(s.g2, cut));
    float size = length(along);
    along = size > 0.0 ? along / size : vec2(1.0, 0.0);
    vec3 g1 = along.x * s.g1 + along.y * s.g2, g2 = along.x * s.g2 - along.y * s.g1;
    axes = vec3[](along.x * axes[0] + along.y * axes[1], along.x * axes[1] - along.y * axes[0]);

    vec2 low = vec2(1e20), high = vec2(-1e20);
    for (uint k = children.x; k < children.x + children.y; ++k) {
        vec3 offset = surfels[k].centre - s.centre;
        vec2 at = vec2(dot(g1, offset), dot(g2, offset));
        vec2 variance = vec2(dot(g1, covariance_times(moments[k], g1)), dot(g2, covariance_times(moments[k], g2)));
        vec2 reach = CHILD_REACH * sqrt(max(variance, vec2(0.0)));
        low = min(low, at - reach);
        high = max(high, at + reach);
    }
    vec2 middle = 0.5 * (low + high);
    vec3 offset = middle.x * axes[0] + middle.y * axes[1];
    vec2 half_size = max(0.5 * (high - low), vec2(1e-3));
    axes = vec3[](half_size.x / IN_CORNERS * axes[0], half_size.y / IN_CORNERS * axes[1]);
    return offset;
}

void main()
{
    uint node = linear_index();
    if (node >= params.node_count) return;
    Surfel s = surfels[node];
    bool is_leaf = node < params.leaf_count;

    vec3 axes[2] = half_axes(s), first = axes[0], second = axes[1], vertex = vec3(0.0);
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
    } else {
        vertex = bound_children(node, s, axes);
        first = axes[0];
        second = axes[1];
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
