#ifndef FACE_CLUSTER_MAKE_ELEMENT
#define FACE_CLUSTER_MAKE_ELEMENT
// How an element comes to be: a cluster placed in the world, and its cubature nodes laid on its faces.
// Bindings 0 to 9 of every kernel that makes elements. Nodes of the rules are those of the receiver, then the shooter's.
#include "lib/cluster_basis.glsl"
#include "lib/face_element.glsl"
#include "lib/shared_exponent.glsl"

layout(set = 0, binding = 0, scalar) readonly buffer Clusters { FaceCluster clusters[]; };          // preorder
layout(set = 0, binding = 1, scalar) readonly buffer Skips { uint cluster_skips[]; };               // per cluster: the first after its subtree
layout(set = 0, binding = 2, scalar) readonly buffer Instances { ClusterInstance instances[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Faces { uint tree_faces[]; };                  // per place of a tree: triangle of the mesh
layout(set = 0, binding = 4, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Rules { CubatureNode rules[]; };
layout(set = 0, binding = 7, scalar) buffer Elements { FaceElement elements[]; };
layout(set = 0, binding = 8, scalar) writeonly buffer Nodes { vec3 element_nodes[]; };              // per element and rule node, metres
layout(set = 0, binding = 9, scalar) buffer Pool { PoolCounters pool[]; };
layout(constant_id = 0) const uint RULE_NODES = 13u;

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

// `point` (world) moved to the faces of a cluster: down the tree, each time to the nearer box.
vec3 laid_on_faces(ClusterInstance inst, uint cluster, vec3 point)
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
    uvec3 v = triangles[inst.first_triangle + tree_faces[inst.first_face + c.first_face]];
    vec3 p0 = positions[v.x], p1 = positions[v.y], p2 = positions[v.z];
    // Off the border, which other faces share: rays along it would meet them.
    return mix(nearest_of_triangle(point, p0, p1, p2), (p0 + p1 + p2) / 3.0, 0.05);
}

void make_element(uint index, uint instance, uint cluster, uint parent, uint level)
{
    ClusterInstance inst = instances[instance];
    FaceCluster c = clusters[cluster];
    mat3 axes = mat3(inst.world_from_tree[0], inst.world_from_tree[1], inst.world_from_tree[2]) / inst.scale;
    bool back = inst.is_back != 0;
    FaceElement e;
    e.cluster = cluster;
    e.instance = instance;
    e.parent = parent;
    e.children = NO_FACE_ELEMENT;
    e.level = level;
    e.first_place = inst.first_triangle + c.first_face;
    e.place_count = face_count(c);
    // What bulges is hollow from behind.                                                      [Gobbetti2003 3.3.3]
    float flat_share = (c.facing[4] - c.facing[5]) / max(c.area, 1e-30);
    e.self_share = (back ? 1.0 : hollowness(c)) * clamp(1.0 - flat_share, 0.0, 1.0);
    e.center = inst.world_from_tree * vec4(c.center, 1.0);
    e.axis_x = axes * rotated(c.rotation, vec3(1, 0, 0));
    e.axis_y = axes * rotated(c.rotation, vec3(0, 1, 0));
    e.axis_z = axes * rotated(c.rotation, vec3(0, 0, back ? -1 : 1));
    e.half_extent = c.half_extent * inst.scale;
    float square = inst.scale * inst.scale;
    e.area = c.area * square;
    // The back's normals are turned about, and so is its z.
    for (uint k = 0; k < 6; ++k) e.facing[k] = square * c.facing[back && k < 4 ? k ^ 1u : k];
    e.albedo = decode_32(c.albedo[1]);
    vec3 most = decode_32(c.albedo[2]);
    e.most_albedo = max(most.x, max(most.y, most.z));
    e.emission = c.emission;
    elements[index] = e;
    [[dont_unroll]] for (uint k = 0; k < RULE_NODES; ++k)
        element_nodes[index * RULE_NODES + k] = laid_on_faces(inst, cluster, plane_point(e, rules[k].uv));
    atomicMax(pool[0].deepest_level, level);
}
#endif
