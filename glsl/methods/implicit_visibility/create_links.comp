#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/footprint.glsl"
#include "lib/surfel.glsl"

// One workgroup per group of receiving nodes of one level of a window, a thread for each: they walk all trees together,
// down to where a sender fits into a bin, and each proposes what it finds to its own bins, which keep the nearest.
//                                                                                                  [Dong2007 4.2.2]
// reads receiver_groups, walk[walk_count], surfels, moments [node_count], receivers, leaf_cells [leaf_count],
// cell_corners, window_levels   updates keys[rows * 6 n n] (distance bits above, back and node below; each row by its own
// thread), link_counts   shared none
// Differs from [Dong2007]: pairs are directed, and a pair is not queued but found by its receiver's walk; a sender fills
// all the bins whose centres see it, at its distance in each, and blocks where it turns its back.
layout(local_size_x = 16) in;
layout(set = 0, binding = 0, scalar) readonly buffer Walk { WalkStep walk[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Surfels { Surfel surfels[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Moments { SurfelMoments moments[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Receivers { Receiver receivers[]; };
layout(set = 0, binding = 4, scalar) readonly buffer LeafCells { LeafCell leaf_cells[]; };
layout(set = 0, binding = 5, scalar) readonly buffer CellCorners { CellCorner cell_corners[]; };
layout(set = 0, binding = 6, scalar) readonly buffer WindowLevels { WindowLevel window_levels[]; };
layout(set = 0, binding = 7, scalar) buffer Keys { uint64_t keys[]; };
layout(set = 0, binding = 8, scalar) buffer Counts { LinkCounts link_counts[]; };
layout(set = 0, binding = 9, scalar) readonly buffer Groups { ReceiverGroup receiver_groups[]; };
layout(push_constant, scalar) uniform Params {
    uint level;
    uint first_group;
    uint group_count;
    uint n;                 // bins a side of a face
    float refinement;       // of a bin's solid angle, what a node may fill; 0 refines down to leaves
    uint is_single;         // 1: one bin a sender, as in the paper
    uint leaf_count;
    uint walk_count;
    uint is_turned;         // leaves' bins are not along the world's axes
} params;

const float FLAT = 1e-3;    // a cell as thin as this, against its radius, is a plane

#include "methods/implicit_visibility/propose.glsl"

// Whether all of the sender lies below the horizon of all points and normals of the receiver.
bool is_below_horizon(vec3 normal, float cos_cone, float radius, float thickness, vec3 towards)
{
    if (cos_cone <= 0.0) return false;
    float sin_cone = sqrt(max(1.0 - cos_cone * cos_cone, 0.0));
    float distance_between = length(towards);
    float along = dot(normal, towards), across = sqrt(max(distance_between * distance_between - along * along, 0.0));
    // Farthest above any plane of the cone that the centre comes.
    float highest = along >= cos_cone * distance_between ? distance_between : along * cos_cone + across * sin_cone;
    float own = radius * sin_cone + thickness * cos_cone;
    float cosine = min(abs(dot(normal, b.normal)), 1.0), sine = sqrt(1.0 - cosine * cosine);
    bool is_upright = cosine * cos_cone <= sine * sin_cone || b.normal == vec3(0.0);
    float reach = is_upright ? b.radius : min(b.radius, b.radius * (sine * cos_cone + cosine * sin_cone) + b.thickness);
    return highest + own + reach <= 1e-3 * distance_between;
}

// Whether a disc of that extent, seen from `distance_there`, fills no more than its share of the bin that `towards` points
// into: a bin's solid angle is 4 / n^2 times the cube of the largest component of its unit direction.
bool fits(float extent, vec3 towards, float distance_there)
{
    vec3 size = abs(towards) / length(towards);
    float largest = max(size.x, max(size.y, size.z));
    return distance_there > 0.0
           && PI * extent * extent * float(params.n * params.n)
                  < 4.0 * params.refinement * largest * largest * largest * distance_there * distance_there;
}

float widest(uint first, uint count)
{
    float extent = 0.0;
    for (uint k = first; k < first + count; ++k) extent = max(extent, surfels[k].extent);
    return extent;
}

void main()
{
    if (linear_index() / 16 >= params.group_count) return;
    ReceiverGroup group = receiver_groups[params.first_group + linear_index() / 16];
    uint lane = linear_index() % 16;
    bool has_above = group.above_count > 0, of_leaves = is_leaf(group.first);
    Surfel g = surfels[group.node], above = surfels[has_above ? group.above_node : group.node];
    float extent = widest(group.first, group.count), extent_above = widest(group.above_first, group.above_count);
    if (lane >= group.count) return;

    WindowLevel own = window_levels[params.level];
    uint receiver = group.first + lane;
    row_first_key = (own.row + receiver - own.first) * 6 * params.n * params.n;
    Surfel a = surfels[receiver];
    at = Receiver(a.centre, a.normal, vec4(0.0, 0.0, 0.0, 1.0));
    if (of_leaves) {
        // It receives at one point with one normal.
        at = receivers[receiver];
        a.cos_cone = 1.0;
        a.radius = a.thickness = 0.0;
    }

    // Where the walk of the group above did not go further down, and left what is below to its children.
    uint left_from_above = has_above ? 0 : params.walk_count;
    uint visited = 0, proposed = 0;
    for (uint k = 0; k < params.walk_count;) {
        WalkStep here = walk[k];
        sender = here.node;
        b = surfels[sender];
        ++visited;
        ++k;
        vec3 from_group = b.centre - g.centre;
        if (is_below_horizon(g.normal, g.cos_cone, g.radius, g.thickness, from_group)) {
            k = here.skip;
            continue;
        }
        if (k > left_from_above) {
            vec3 towards = b.centre - above.centre;
            float nearest = length(towards) - above.radius;
            if (is_leaf(sender) || fits(b.extent, towards, nearest)) {
                left_from_above = here.skip;
                if (fits(extent_above, towards, nearest)) {
                    k = here.skip;      // the link from above comes down
                    continue;
                }
            }
        }
        float nearest = length(from_group) - g.radius;
        bool is_refined = !is_leaf(sender) && !fits(b.extent, from_group, nearest);
        if (!of_leaves) {
            float farthest = nearest + (is_refined ? b.radius : 0.0);
            bool may_fit = is_refined ? PI * extent * extent * float(params.n * params.n) < 4.0 * params.refinement * farthest * farthest
                                      : fits(extent, from_group, nearest);
            if (!may_fit) {
                k = here.skip;          // left to the children
                continue;
            }
        }
        if (is_refined) continue;
        k = here.skip;
        offset = b.centre - at.origin;
        bool is_flat = b.thickness <= FLAT * b.radius;
        if (receiver == sender && is_flat) continue;
        if (is_below_horizon(at.normal, a.cos_cone, a.radius, a.thickness, offset)) continue;
        ++proposed;
        link();
    }
    atomicAdd(link_counts[0].visited, visited);
    atomicAdd(link_counts[0].proposed, proposed);
}
