#version 460
#include "lib/prelude.glsl"
#include "lib/bins.glsl"
#include "lib/emitter.glsl"
#include "lib/quadtree.glsl"

// One thread per leaf of a window and word of samples: which points on emitters it sees. The bins are an omnidirectional
// shadow map: a point is hidden where it lies behind the winners around its direction.             [Dong2007 3]
// reads winners[6 n n * leaf_count of the window], receivers, leaf_elements, surfels, ancestors [node_count],
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
layout(set = 0, binding = 8, scalar) readonly buffer Ancestors { uint ancestors[]; };
layout(push_constant, scalar) uniform Params {
    uint first_leaf;
    uint leaf_count;    // of the window
    uint n;
    uint sample_count;
} params;

// How a winner stands to a point that is looked at.
struct Shade {
    bool by_plane;      // its plane passes between the receiver and the point
    bool is_beside;     // and where it does is no farther off the winner than the next bins are, and on the same surface
    bool by_itself;     // or is the winner itself
};

bool is_within(Surfel s, vec3 place)
{
    float x = dot(s.g1, place - s.centre), y = dot(s.g2, place - s.centre);
    return x * x + y * y <= 1.0;
}

Shade shade_of(uint winner, vec3 origin, vec3 point)
{
    if (winner == EMPTY_BIN) return Shade(false, false, false);
    uint node = winner & NODE_MASK;
    Surfel s = surfels[node];
    float of_origin = dot(s.normal, origin - s.centre), of_point = dot(s.normal, point - s.centre);
    float slack = s.thickness + 0.02 * s.extent;
    if (!(of_origin > 0.0 ? of_point < -slack : of_point > slack)) return Shade(false, false, false);
    vec3 met = mix(origin, point, of_origin / (of_origin - of_point));
    vec3 there = met - s.centre;
    float reach = s.extent + 2.0 / float(params.n) * length(met - origin);
    bool is_beside = dot(there, there) <= reach * reach && is_within(surfels[ancestors[node]], met);
    return Shade(true, is_beside, is_within(s, met));
}

// A point is hidden by a winner of one of the four bins around its direction, or by the surface that lies before it in
// all four. Where only some have it before the point, its edge passes between them: halfway, as far as the bins can tell,
// so that those decide that are nearer to its direction.
bool is_visible(uint local, Receiver at, vec3 point)
{
    vec3 direction = turn_back(at.frame, point - at.origin);
    uint face = face_of(direction);
    vec3 in_axes = in_face(face, direction);
    vec2 place = (0.5 * in_axes.xy / in_axes.z + 0.5) * float(params.n) - 0.5, low = floor(place), share = place - low;
    bool by_all = true, by_one = false;
    float hidden = 0.0;
    for (uint corner = 0; corner < 4; ++corner) {
        // Beyond the face's rim the direction leads to a neighbouring face.
        vec2 side = vec2(corner & 1, corner >> 1), uv = (2.0 * (low + side) + 1.0) / float(params.n) - 1.0;
        uint bin = bin_of(face_direction(face, uv), params.n);
        Shade shade = shade_of(winners[bin * params.leaf_count + local], at.origin, point);
        vec2 weights = mix(1.0 - share, share, side);
        by_all = by_all && shade.by_plane;
        by_one = by_one || shade.by_itself;
        hidden += shade.is_beside ? weights.x * weights.y : 0.0;
    }
    return !by_all && !by_one && hidden <= 0.5;
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
