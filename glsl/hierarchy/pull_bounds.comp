#version 460
#include "lib/prelude.glsl"
#include "lib/hierarchy.glsl"
#include "lib/unit.glsl"

// One thread per inner node of one level: area, centre of area, bounding sphere and rectangle from the children's.
// reads level_nodes   updates nodes[node_count]; the level below is already done   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer LevelNodes { uint level_nodes[]; };
layout(set = 0, binding = 1, scalar) buffer Nodes { HierarchyNode nodes[]; };
layout(push_constant, scalar) uniform Params { uint first; uint count; } params;

void main()
{
    uint k = linear_index();
    if (k >= params.count) return;
    uint node = level_nodes[params.first + k];

    uint end = nodes[node].skip;
    vec3 weighted = vec3(0.0), sum = vec3(0.0);
    float area = 0.0, count = 0.0;
    for (uint child = node + 1; child < end; child = nodes[child].skip) {
        weighted += nodes[child].area * nodes[child].center;
        sum += nodes[child].center;
        area += nodes[child].area;
        count += 1.0;
    }
    vec3 center = area > 0.0 ? weighted / area : sum / count;
    float radius = 0.0;
    for (uint child = node + 1; child < end; child = nodes[child].skip)
        radius = max(radius, distance(center, nodes[child].center) + nodes[child].radius);
    // A rectangle along the first child's, of the same second moments as the children's together.
    vec3 u = vec3(0.0), v = vec3(0.0);
    if (nodes[node].shape != NONE && area > 0.0) {
        u = unit_or(nodes[node + 1].half_u, vec3(0.0));
        v = unit_or(nodes[node + 1].half_v, vec3(0.0));
        vec2 moments = vec2(0.0);
        for (uint child = node + 1; child < end; child = nodes[child].skip) {
            vec3 offset = nodes[child].center - center, a = nodes[child].half_u, b = nodes[child].half_v;
            vec2 at = vec2(dot(offset, u), dot(offset, v)), du = vec2(dot(a, u), dot(b, u)), dv = vec2(dot(a, v), dot(b, v));
            moments += nodes[child].area * (at * at + vec2(dot(du, du), dot(dv, dv)) / 3.0);
        }
        u *= sqrt(3.0 * moments.x / area);
        v *= sqrt(3.0 * moments.y / area);
    }
    nodes[node].half_u = u;
    nodes[node].half_v = v;
    nodes[node].center = center;
    nodes[node].radius = radius;
    nodes[node].area = area;
}
