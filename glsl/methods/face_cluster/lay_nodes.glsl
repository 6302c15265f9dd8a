#ifndef FACE_CLUSTER_LAY_NODES
#define FACE_CLUSTER_LAY_NODES
// Where an element's cubature nodes stand: on its faces, where these are not hidden inside other bodies. Included where
// the tables of make_element are bound.
#include "methods/face_cluster/hidden.glsl"

// Places that are looked at for a node.
const uint TRIES = 8;
// Share of an element's area that is not hidden, at least: what all places that are looked at miss.
const float LEAST_EXPOSED = 1.0 / 256.0;

// The nearest point of a triangle.                                                             [Ericson2004 5.1.5]
vec3 nearest_of_triangle(vec3 p, vec3 a, vec3 b, vec3 c)
{
    vec3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
    float d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp), d5 = dot(ab, cp), d6 = dot(ac, cp);
    if (d1 <= 0.0 && d2 <= 0.0) return a;
    if (d3 >= 0.0 && d4 <= d3) return b;
    if (d6 >= 0.0 && d5 <= d6) return c;
    float vc = d1 * d4 - d3 * d2;
    if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return a + ab * (d1 / max(d1 - d3, 1e-30));
    float vb = d5 * d2 - d1 * d6;
    if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return a + ac * (d2 / max(d2 - d6, 1e-30));
    float va = d3 * d6 - d5 * d4;
    float along = d4 - d3, back = d5 - d6;
    if (va <= 0.0 && along >= 0.0 && back >= 0.0) return b + (c - b) * (along / max(along + back, 1e-30));
    float sum = va + vb + vc;
    return sum > 0.0 ? a + ab * (vb / sum) + ac * (vc / sum) : a;
}

vec3 clamped_to_box(FaceCluster c, vec3 point)
{
    vec4 inverse = vec4(-c.rotation.xyz, c.rotation.w);
    return c.center + rotated(c.rotation, clamp(rotated(inverse, point - c.center), -c.half_extent, c.half_extent));
}

void corners_of(ClusterInstance inst, uint face, out vec3 corners[3])
{
    uvec3 v = triangles[inst.first_triangle + tree_faces[inst.first_face + face]];
    corners = vec3[3](positions[v.x], positions[v.y], positions[v.z]);
}

// Of the front; `otherwise` where there is no area.
vec3 normal_of(vec3 corners[3], vec3 otherwise)
{
    vec3 across = cross(corners[1] - corners[0], corners[2] - corners[0]);
    float size = length(across);
    return size > 0.0 ? across / size : otherwise;
}

// `point` (world) moved to the faces of a cluster: down the tree, each time to the nearer box. `normal` becomes that of
// the face's front.
vec3 laid_on_faces(ClusterInstance inst, uint cluster, vec3 point, inout vec3 normal)
{
    vec3 d = point - inst.world_from_tree[3];
    vec3 q = vec3(dot(inst.world_from_tree[0], d), dot(inst.world_from_tree[1], d), dot(inst.world_from_tree[2], d)) / (inst.scale * inst.scale);
    while (cluster_skips[cluster] != cluster + 1) {
        uint left = cluster + 1, right = cluster_skips[left];
        vec3 to_left = clamped_to_box(clusters[left], q) - q, to_right = clamped_to_box(clusters[right], q) - q;
        cluster = dot(to_left, to_left) <= dot(to_right, to_right) ? left : right;
    }
    FaceCluster c = clusters[cluster];
    if (face_count(c) > 1) return inst.world_from_tree * vec4(clamped_to_box(c, q), 1.0);
    vec3 corners[3];
    corners_of(inst, first_face(c), corners);
    normal = normal_of(corners, normal);
    // Off the border, which other faces share: rays along it would meet them.
    return mix(nearest_of_triangle(point, corners[0], corners[1], corners[2]), (corners[0] + corners[1] + corners[2]) / 3.0, 0.05);
}

// Lays all nodes; returns the share of the element's area that is not hidden. Nodes that are hidden are moved to where
// some are not. A single face has a rule of its own, for triangles.
// Differs from [Gobbetti2003]: there nodes lie in the box's plane, on its whole square.
float lay_nodes(uint index, FaceElement e, ClusterInstance inst, float ray_offset)
{
    bool is_face = e.place_count == 1;
    float side = inst.is_back != 0 ? -1.0 : 1.0;
    vec3 corners[3];
    if (is_face) corners_of(inst, e.first_place - inst.first_triangle, corners);
    vec3 laid_places[RULE_NODES], laid_normals[RULE_NODES];
    uint hidden = 0;
    uint seen = 0, tried = 0;
    [[dont_unroll]] for (uint k = 0; k < RULE_NODES; ++k) {
        CubatureNode node = rules[is_face ? RULE_NODES + k : k];
        vec3 place = vec3(0.0), normal;
        bool is_free = false;
        [[dont_unroll]] for (uint t = 0; t < TRIES && !is_free; ++t) {
            // An even sequence of places, from the rule's on.                                  [Roberts2018]
            vec2 uv = fract(node.uv + float(t) * vec2(0.7548776662466927, 0.5698402909980532));
            normal = side * e.axis_z;
            if (is_face) {
                if (uv.x + uv.y > 1.0) uv = 1.0 - uv;
                place = corners[0] + uv.x * (corners[1] - corners[0]) + uv.y * (corners[2] - corners[0]);
                normal = normal_of(corners, normal);
            } else {
                place = laid_on_faces(inst, e.cluster, plane_point(e, uv), normal);
            }
            is_free = !is_hidden(place, side * normal, ray_offset);
            ++tried;
        }
        if (is_free) seen = k;
        hidden |= is_free ? 0u : 1u << k;
        laid_places[k] = place;
        laid_normals[k] = side * normal;
    }
    [[dont_unroll]] for (uint k = 0; k < RULE_NODES; ++k) {
        // Where none was found for one, that of the one before it.
        if ((hidden >> k & 1u) == 0) seen = k;
        else if (bitCount(hidden) < RULE_NODES) {
            laid_places[k] = laid_places[seen];
            laid_normals[k] = laid_normals[seen];
        }
        element_nodes[index * RULE_NODES + k] = laid_places[k];
        node_normals[index * RULE_NODES + k] = packSnorm4x8(vec4(laid_normals[k], 0.0));
    }
    return max(float(RULE_NODES - bitCount(hidden)) / float(tried), LEAST_EXPOSED);
}
#endif
