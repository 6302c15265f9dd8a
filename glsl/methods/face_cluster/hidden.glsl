#ifndef FACE_CLUSTER_HIDDEN
#define FACE_CLUSTER_HIDDEN
// Whether a place of a surface lies inside a closed body, where light never comes: whether a ray from there leaves such
// bodies more often than it enters any. Bindings 10 to 12 of every kernel that makes elements.
layout(set = 0, binding = 10) uniform usamplerBuffer bvh_nodes;
layout(set = 0, binding = 11) uniform usamplerBuffer bvh_triangles;
layout(set = 0, binding = 12, scalar) readonly buffer Solids { uint solids[]; };    // a bit per triangle: of a closed body

uvec4 bvh_node_texel(uint i) { return texelFetch(bvh_nodes, int(i)); }
uvec4 bvh_triangle_texel(uint i) { return texelFetch(bvh_triangles, int(i)); }

vec3 way = vec3(0.0);
int bodies = 0;         // left, less those entered

bool is_lit_side(uint triangle, bool is_back) { return true; }

// Counts, and lets the ray go on.
bool is_hole(uint triangle, vec2 barycentrics)
{
    if (bitfieldExtract(solids[triangle >> 5], int(triangle & 31u), 1) != 0) {
        uvec3 v = triangles[triangle];
        vec3 p = positions[v.x];
        bodies += dot(cross(positions[v.y] - p, positions[v.z] - p), way) > 0.0 ? 1 : -1;
    }
    return true;
}

#include "lib/bvh.glsl"

// `normal`: to the side that is looked at; `offset`: what is nearer counts as this very place, metres.
bool is_hidden(vec3 place, vec3 normal, float offset)
{
    // Off the normal, which runs along the edges of what is built at right angles.
    vec3 aside = abs(normal.x) < 0.5 ? vec3(1, 0, 0) : vec3(0, 1, 0);
    way = normalize(normal + 0.07 * aside + 0.03 * cross(normal, aside));
    bodies = 0;
    traverse(Ray(place, offset, way, 3e38), true);
    return bodies > 0;
}
#endif
