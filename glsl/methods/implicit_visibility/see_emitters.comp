#version 460
#include "lib/prelude.glsl"
#include "lib/bins.glsl"
#include "lib/emitter.glsl"
#include "lib/quadtree.glsl"

// One thread per leaf of a window and word of samples: which points on emitters it sees. The bins are an omnidirectional
// shadow map whose pixels say which surface is there: that surface, not the pixel, hides the point.            [Dong2007 3]
// reads winners[6 n n * leaf_count of the window], receivers, leaf_elements, surfels, node_segments [node_count], segments,
// samples[sample_count], triangles, positions   writes visible[element_count * ceil(sample_count / 32)] (bits)   shared none
// Differs from [Dong2007]: every point is tested, so that an emitter smaller than a bin keeps its size and its shadow.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Winners { uint winners[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Receivers { Receiver receivers[]; };
layout(set = 0, binding = 2, scalar) readonly buffer LeafElements { uint leaf_elements[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Surfels { Surfel surfels[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Samples { EmitterSample samples[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 7, scalar) writeonly buffer Visible { uint visible[]; };
layout(set = 0, binding = 8, scalar) readonly buffer NodeSegments { uint node_segments[]; };
layout(set = 0, binding = 9, scalar) readonly buffer Segments { QuadtreeSegment segments[]; };
layout(push_constant, scalar) uniform Params {
    uint first_leaf;
    uint leaf_count;    // of the window
    uint n;
    uint sample_count;
} params;

// Neighbours of a winner that tell whether its surface goes on: what lies below the node two levels up.
const uint NEIGHBOURS = 16;
// So much of its extent off its plane, and a surfel's ellipse does not tell where its surface is.
const float BENT = 0.02;

// Where a surfel's plane passes between the receiver and the point.
struct Crossing {
    bool is_between;
    bool is_within;     // in its ellipse
    bool is_beside;     // no farther off than the next bins are
};

Crossing crossing_of(Surfel s, vec3 origin, vec3 point)
{
    float of_origin = dot(s.normal, origin - s.centre), of_point = dot(s.normal, point - s.centre);
    float slack = s.thickness + 0.02 * s.extent;
    bool is_between = of_origin > 0.0 ? of_point < -slack : of_point > slack;
    vec3 met = mix(origin, point, of_origin / (of_origin - of_point)), there = met - s.centre;
    float x = dot(s.g1, there), y = dot(s.g2, there), reach = s.extent + 2.0 / float(params.n) * length(met - origin);
    return Crossing(is_between, is_between && x * x + y * y <= 1.0, is_between && dot(there, there) <= reach * reach);
}

// A point is hidden where the surface of a winner of one of the four bins around its direction passes before it: the winner
// itself, or where the surface goes on. Bent ones, whose place between the bins is not known, hide what is nearer to the
// directions of such winners than to others'.
bool is_visible(uint local, Receiver at, vec3 point)
{
    vec3 direction = turn_back(at.frame, point - at.origin);
    uint face = face_of(direction);
    vec3 in_axes = in_face(face, direction);
    vec2 place = (0.5 * in_axes.xy / in_axes.z + 0.5) * float(params.n) - 0.5, low = floor(place), share = place - low;
    uint looked_at = EMPTY_BIN;     // neighbours that do not hide it
    float hidden = 0.0;
    for (uint corner = 0; corner < 4; ++corner) {
        // Beyond the face's rim the direction leads to a neighbouring face.
        vec2 side = vec2(corner & 1, corner >> 1), uv = (2.0 * (low + side) + 1.0) / float(params.n) - 1.0;
        uint winner = winners[bin_of(face_direction(face, uv), params.n) * params.leaf_count + local];
        if (winner == EMPTY_BIN) continue;
        uint node = winner & NODE_MASK;
        Surfel s = surfels[node];
        Crossing own = crossing_of(s, at.origin, point);
        if (own.is_within) return false;
        vec2 weights = mix(1.0 - share, share, side);
        if (own.is_beside && s.thickness > BENT * s.extent) hidden += weights.x * weights.y;
        QuadtreeSegment level = segments[node_segments[node]];
        uint first = level.first + (node - level.first) / NEIGHBOURS * NEIGHBOURS;
        if (!own.is_between || first == looked_at) continue;
        uint last = min(first + NEIGHBOURS, level.first + level.count);
        for (uint k = first; k < last; ++k) {
            if (crossing_of(surfels[k], at.origin, point).is_within) return false;
        }
        looked_at = first;
    }
    return hidden <= 0.5;
}

void main()
{
    uint words = (params.sample_count + 31) / 32;
    uint i = linear_index();
    if (i >= params.leaf_count * words) return;
    uint local = i % params.leaf_count, word = i / params.leaf_count;
    Receiver at = receivers[params.first_leaf + local];
    uint bits = 0;
    for (uint k = 0; k < 32 && word * 32 + k < params.sample_count; ++k) {
        EmitterSample s = samples[word * 32 + k];
        uvec3 v = triangles[s.triangle];
        EmitterPoint point = emitter_point(s, positions[v.x], positions[v.y], positions[v.z]);
        vec3 offset = point.position - at.origin;
        if (dot(offset, at.normal) <= 0.0 || emitter_cosine(s, point, -offset) <= 0.0) continue;
        if (is_visible(local, at, point.position)) bits |= 1u << k;
    }
    visible[leaf_elements[params.first_leaf + local] * words + word] = bits;
}
