#version 460
#include "lib/prelude.glsl"
#include "lib/emitter.glsl"
#include "methods/implicit_visibility/emitter_points.glsl"

// One thread per word of samples: where its points on emitters are, and the box that ways to them end in.
//                                                                                                  [Dong2007 4.4]
// reads samples[sample_count], triangles, positions   writes points[sample_count], bundles[ceil(sample_count / 32)]
// shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Samples { EmitterSample samples[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Points { PointSeen points[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer Bundles { Bundle bundles[]; };
layout(push_constant, scalar) uniform Params { uint sample_count; float ray_offset; } params;    // ray_offset: m

void main()
{
    uint word = linear_index();
    uint first = 32 * word, end = min(first + 32, params.sample_count);
    if (first >= end) return;
    vec3 low = vec3(3e38), high = vec3(-3e38);
    for (uint k = first; k < end; ++k) {
        EmitterSample s = samples[k];
        uvec3 v = triangles[s.triangle];
        EmitterPoint point = emitter_point(s, positions[v.x], positions[v.y], positions[v.z]);
        PointSeen seen = PointSeen(point.position, point.normal, s.is_double_sided);
        points[k] = seen;
        vec3 front = end_of_way(seen, false, params.ray_offset), back = end_of_way(seen, s.is_double_sided != 0, params.ray_offset);
        low = min(low, min(front, back));
        high = max(high, max(front, back));
    }
    bundles[word] = Bundle(0.5 * (low + high), 0.5 * (high - low));
}
