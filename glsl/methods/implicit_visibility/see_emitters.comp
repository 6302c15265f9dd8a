#version 460
#include "lib/prelude.glsl"
#include "lib/bins.glsl"
#include "lib/emitter.glsl"
#include "lib/quadtree.glsl"

// One thread per leaf of a window and word of samples: which points on emitters it sees. The bins are an omnidirectional
// shadow map: a point is hidden where it lies behind the plane of its bin's winner.                [Dong2007 3]
// reads winners[6 n n * leaf_count of the window], receivers, leaf_elements, surfels[node_count], samples[sample_count],
// triangles, positions   writes visible[element_count * ceil(sample_count / 32)] (bits)   shared none
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
layout(push_constant, scalar) uniform Params {
    uint first_leaf;
    uint leaf_count;    // of the window
    uint n;
    uint sample_count;
} params;

// Whether the winner stands between the receiver and the point.
bool is_hidden_by(uint winner, vec3 origin, vec3 point)
{
    if (winner == EMPTY_BIN) return false;
    Surfel s = surfels[winner & NODE_MASK];
    float of_origin = dot(s.normal, origin - s.centre), of_point = dot(s.normal, point - s.centre);
    float slack = s.thickness + 0.02 * s.extent;
    return of_origin > 0.0 ? of_point < -slack : of_point > slack;
}

// Share of the four bins around the direction, by nearness, whose winners leave the point free: where only some do, the
// edge of a shadow passes between them.
float visible_share(uint local, Receiver at, vec3 offset, vec3 point)
{
    vec3 direction = turn_back(at.frame, offset);
    uint face = face_of(direction);
    vec3 in_axes = in_face(face, direction);
    vec2 place = (0.5 * in_axes.xy / in_axes.z + 0.5) * float(params.n) - 0.5;
    vec2 low = floor(place), f = place - low;
    float share = 0.0;
    for (uint corner = 0; corner < 4; ++corner) {
        vec2 step_to = vec2(corner & 1, corner >> 1);
        vec2 weights = mix(1.0 - f, f, step_to);
        // Beyond the face's rim the direction leads to a neighbouring face.
        vec2 uv = (2.0 * (low + step_to) + 1.0) / float(params.n) - 1.0;
        uint bin = bin_of(face_direction(face, uv), params.n);
        if (!is_hidden_by(winners[bin * params.leaf_count + local], at.origin, point)) share += weights.x * weights.y;
    }
    return share;
}

// Thresholds of the samples fill 0..1 evenly, so that all of them together see as much of the emitter as is free.
float threshold(uint k) { return fract(0.5 + 0.618033989 * float(k)); }

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
        if (visible_share(local, at, offset, point.position) > threshold(word * 32 + k)) bits |= 1u << k;
    }
    visible[leaf_elements[params.first_leaf + local] * words + word] = bits;
}
