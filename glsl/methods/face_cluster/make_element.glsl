#ifndef FACE_CLUSTER_MAKE_ELEMENT
#define FACE_CLUSTER_MAKE_ELEMENT
// How an element comes to be: a cluster placed in the world. Bindings 0 to 14 and 16 of every kernel that makes elements. Nodes
// of the rules are those of the receiver, then the shooter's; rules on the square, then on a triangle.
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
layout(set = 0, binding = 8, scalar) buffer Nodes { vec3 element_nodes[]; };                        // per element and rule node, metres
layout(set = 0, binding = 9, scalar) buffer Pool { PoolCounters pool[]; };
layout(set = 0, binding = 13, scalar) writeonly buffer Fits { float fits[]; };                      // per element: of each function and receiver node, then of each shooter node
layout(set = 0, binding = 16, scalar) writeonly buffer Normals { uint node_normals[]; };            // per element and rule node: packSnorm4x8
layout(set = 0, binding = 14, scalar) writeonly buffer FunctionMeans { float function_means[]; };   // per element and function
layout(constant_id = 0) const uint RECEIVER_NODES = 7u;
layout(constant_id = 1) const uint SHOOTER_NODES = 6u;
layout(constant_id = 2) const uint IRRADIANCE_FUNCTIONS = 3u;
layout(constant_id = 3) const uint LAID_FUNCTIONS = 6u;    // through receiver nodes: as many as they can tell
layout(constant_id = 4) const uint SENT_FUNCTIONS = 6u;    // through shooter nodes
const uint RULE_NODES = RECEIVER_NODES + SHOOTER_NODES;

#include "methods/face_cluster/lay_nodes.glsl"
#include "methods/face_cluster/fit_functions.glsl"

void make_element(uint index, uint instance, uint cluster, uint parent, uint level, float ray_offset)
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
    e.first_place = inst.first_triangle + first_face(c);
    e.place_count = face_count(c);
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

    // What is hidden is no surface.
    float share = lay_nodes(index, e, inst, ray_offset);
    e.is_part_hidden = uint(share > LEAST_EXPOSED && share < 1.0);
    e.area *= share;
    for (uint k = 0; k < 6; ++k) e.facing[k] *= share;
    // Differs from [Gobbetti2003]: there the bound is taken (3.3.3), which most of what lies apart does not come near.
    e.self_share = self_share(c, back) * clamp(1.0 - vector_area(e) / max(e.area, 1e-30), 0.0, 1.0);
    elements[index] = e;
    fit_functions(index, e, inst, share == 1.0);
    atomicMax(pool[0].deepest_level, level);
}
#endif
