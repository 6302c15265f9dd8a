#version 460
#include "lib/prelude.glsl"
#include "lib/bins.glsl"
#include "lib/hemisphere.glsl"
#include "lib/quadtree.glsl"
#include "methods/implicit_visibility/horizon.glsl"
#include "methods/implicit_visibility/link_texels.glsl"

// One thread per group of receiving nodes: walks all trees, down to where a sender fits into a bin of all of the group's
// nodes, and holds those senders, by kind, for linking. Where a list is full it stops, to go on from there the next time.
//                                                                                                  [Dong2007 4.2.2]
// reads receiver_groups, walk_texels[WALK_TEXELS * node_count], surfels[node_count]
// updates group_walks[group_count], link_counts, unfinished[1] (1: a walk stopped)
// writes held_senders[KINDS * capacity * group_count]   shared none
// Differs from [Dong2007]: pairs are directed, and a pair is not queued but found by its receiver's walk; bent nodes are
// refined further, and receivers further than senders.
layout(local_size_x = 16) in;
layout(set = 0, binding = 0) uniform usamplerBuffer walk_texels;
layout(set = 0, binding = 1, scalar) readonly buffer Surfels { Surfel surfels[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Groups { ReceiverGroup receiver_groups[]; };
layout(set = 0, binding = 3, scalar) buffer Walks { GroupWalk group_walks[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer Held { uint held_senders[]; };
layout(set = 0, binding = 5, scalar) buffer Counts { LinkCounts link_counts[]; };
layout(set = 0, binding = 6, scalar) buffer Unfinished { uint unfinished[]; };
layout(push_constant, scalar) uniform Params {
    uint first_group;
    uint group_count;
    uint n;                 // bins a side of a face
    float refinement;       // of a bin's solid angle, what a node may fill; 0 refines down to leaves
    uint leaf_count;
    uint walk_count;
    uint capacity;          // senders of each kind that a group may hold
    uint is_start;          // 1: walks start here
} params;

// How much more a sender counts where it is bent: there a parallelogram is no good outline.
const float BENT = 3.0;
// How much more a receiver counts than a sender: links are received at its middle, and what its leaves see by them is off
// by its own size, a quarter of a bin at most.
const float PARALLAX = 32.0;
// What flat ones are foreshortened to at most: their outlines are off at their rims, and those of steep ones far.
const float STEEPEST = 0.5;

// What a sender shows of itself, m2: its disc foreshortened as its cone of normals allows.
float shown_area(vec3 normal, float sin_cone, float extent, vec3 towards)
{
    float foreshortening = clamp(abs(dot(normal, towards)) / length(towards) + sin_cone, STEEPEST, 1.0);
    return PI * extent * extent * foreshortening * (1.0 + BENT * sin_cone);
}

// Whether an area, seen from `distance_there`, fills no more than its share of the bin that `towards` points into: a bin's
// solid angle is 4 / n^2 times the cube of the largest component of its unit direction.
bool fits(float area, vec3 towards, float distance_there)
{
    vec3 size = abs(towards) / length(towards);
    float largest = max(size.x, max(size.y, size.z));
    return distance_there > 0.0
           && area * float(params.n * params.n)
                  < 4.0 * params.refinement * largest * largest * largest * distance_there * distance_there;
}

// From a group to a sender: what is typical of its nodes. The nearest may be much nearer, but few are.
float distance_to(vec3 offset, float radius) { return sqrt(max(dot(offset, offset) - radius * radius, 0.0)); }

// Of the discs of nodes that receive, m2.
float largest_area(uint first, uint count)
{
    float extent = 0.0;
    for (uint k = first; k < first + count; ++k) extent = max(extent, surfels[k].extent);
    return PARALLAX * PI * extent * extent;
}

void main()
{
    uint slot = linear_index();
    if (slot >= params.group_count) return;
    ReceiverGroup group = receiver_groups[params.first_group + slot];
    bool has_above = group.above_count > 0, of_leaves = group.first < params.leaf_count;
    Surfel own = surfels[group.node], above = surfels[has_above ? group.above_node : group.node];
    Horizon receiver = Horizon(own.normal, own.cos_cone, reach_above(own.cos_cone, own.radius, own.thickness));
    float area = largest_area(group.first, group.count), area_above = largest_area(group.above_first, group.above_count);

    GroupWalk at = group_walks[slot];
    // Where the walk of the group above did not go further down, and left what is below to its children.
    if (params.is_start != 0) at = GroupWalk(0, has_above ? 0 : params.walk_count, uvec4(0));
    at.held = uvec4(0);
    uint first = KINDS * params.capacity * slot, visited = 0;
    // Without branches but the last: where threads run in lockstep, each is taken by some.
    while (at.step < params.walk_count && max(max(at.held.x, at.held.y), max(at.held.z, at.held.w)) < params.capacity) {
        vec4 centre = uintBitsToFloat(texelFetch(walk_texels, int(WALK_TEXELS * at.step)));
        vec4 facing = uintBitsToFloat(texelFetch(walk_texels, int(WALK_TEXELS * at.step + 1)));
        uvec4 rest = texelFetch(walk_texels, int(WALK_TEXELS * at.step + 2));
        uint sender = rest.x, skip = rest.y;
        float radius = centre.w, thickness = uintBitsToFloat(rest.z), cos_cone = uintBitsToFloat(rest.w);
        float sin_cone = cos_cone > 0.0 ? sqrt(1.0 - min(cos_cone * cos_cone, 1.0)) : 1.0;
        bool is_leaf = sender < params.leaf_count;
        ++visited;

        vec3 offset = centre.xyz - own.centre;
        bool is_dropped = is_below_horizon(receiver, Extents(facing.xyz, radius, thickness), offset);

        vec3 from_above = centre.xyz - above.centre;
        float far_above = distance_to(from_above, above.radius);
        bool ends_above = !is_dropped && at.step >= at.left_from_above
                          && (is_leaf || fits(shown_area(facing.xyz, sin_cone, facing.w, from_above), from_above, far_above));
        at.left_from_above = ends_above ? skip : at.left_from_above;
        is_dropped = is_dropped || (ends_above && fits(area_above, from_above, far_above));  // that link comes down

        float far = distance_to(offset, own.radius);
        bool is_refined = !is_leaf && !fits(shown_area(facing.xyz, sin_cone, facing.w, offset), offset, far);
        float farthest = length(offset) + radius;
        bool may_fit = is_refined ? area * float(params.n * params.n) < 4.0 * params.refinement * farthest * farthest
                                  : fits(area, offset, far);
        is_dropped = is_dropped || (!of_leaves && !may_fit);    // left to the children

        if (!is_dropped && !is_refined) {
            uint of_leaf = is_flat(thickness, radius) ? OF_FLAT_LEAVES : OF_LEAVES;
            uint of_node = has_plane(cos_cone) ? OF_PLANES : OF_OUTLINES;
            uvec4 is_kind = uvec4(equal(uvec4(0, 1, 2, 3), uvec4(is_leaf ? of_leaf : of_node)));
            uvec4 place = is_kind * (at.held + uvec4(0, 1, 2, 3) * params.capacity);
            held_senders[first + place.x + place.y + place.z + place.w] = sender;
            at.held += is_kind;
        }
        at.step = is_refined && !is_dropped ? at.step + 1 : skip;
    }
    group_walks[slot] = at;
    if (at.step < params.walk_count) atomicOr(unfinished[0], 1);
    atomicAdd(link_counts[0].visited, visited * group.count);
}
