#ifndef FACE_CLUSTER_RECEIVE
#define FACE_CLUSTER_RECEIVE
// Bindings 0 to 12, 21, 23 and set 1 of every kernel that decides pairs: whether light passes between two places, and what the
// receiver keeps of it. Faces of the two elements block nothing: what one side of a cluster does to the other is the
// matter of its self transfer.
#include "lib/bvh.glsl"
#include "lib/cluster_basis.glsl"
#include "lib/face_element.glsl"
#include "lib/material.glsl"
#include "lib/pair_queue.glsl"

layout(set = 0, binding = 0) uniform usamplerBuffer bvh_nodes;
layout(set = 0, binding = 1) uniform usamplerBuffer bvh_triangles;
layout(set = 0, binding = 2, scalar) readonly buffer SceneTriangles { uvec3 triangles[]; };
layout(set = 0, binding = 3, scalar) readonly buffer TriangleMaterials { uint triangle_materials[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Attributes { VertexAttributes attributes[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Materials { Material materials[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Places { uint triangle_places[]; };            // per triangle
layout(set = 0, binding = 7, scalar) readonly buffer Elements { FaceElement elements[]; };
layout(set = 0, binding = 8, scalar) readonly buffer Nodes { vec3 element_nodes[]; };
layout(set = 0, binding = 9, scalar) readonly buffer Fits { float fits[]; };                       // per element: of each function and receiver node, then of each shooter node
layout(set = 0, binding = 10, scalar) readonly buffer Skips { uint cluster_skips[]; };
layout(set = 0, binding = 11, scalar) buffer Arriving { int arriving[]; };                          // per element, function, channel, axis
layout(set = 0, binding = 12, scalar) buffer Pool { PoolCounters pool[]; };
layout(set = 0, binding = 21, scalar) readonly buffer Rules { CubatureNode rules[]; };               // of the receiver, then the shooter: on the square, then on a triangle
layout(set = 0, binding = 23, scalar) readonly buffer Normals { uint node_normals[]; };            // per element and rule node: packSnorm4x8
layout(set = 1, binding = 0) uniform sampler2D textures[];
layout(constant_id = 0) const uint RECEIVER_NODES = 7u;
layout(constant_id = 1) const uint SHOOTER_NODES = 6u;
layout(constant_id = 2) const uint IRRADIANCE_FUNCTIONS = 3u;
const uint RULE_NODES = RECEIVER_NODES + SHOOTER_NODES;
const uint FITS = IRRADIANCE_FUNCTIONS * RECEIVER_NODES + SHOOTER_NODES;
layout(constant_id = 3) const bool ALPHA_TEST = false;
layout(constant_id = 5) const bool CLUSTERS_BLOCK = false;  // multiresolution visibility instead of rays

uvec4 bvh_node_texel(uint i) { return texelFetch(bvh_nodes, int(i)); }
uvec4 bvh_triangle_texel(uint i) { return texelFetch(bvh_triangles, int(i)); }
vec4 sample_texture(TextureSlot slot, vec2 uv) { return textureLod(textures[nonuniformEXT(slot.texture)], uv, 0.0); }

// Places of the faces that block nothing: first and count of the receiver and of the shooter.
uvec4 passed_places = uvec4(0);

bool is_lit_side(uint triangle, bool is_back) { return true; }

bool is_hole(uint triangle, vec2 barycentrics)
{
    uint place = triangle_places[triangle];
    if (place - passed_places.x < passed_places.y || place - passed_places.z < passed_places.w) return true;
    if (ALPHA_TEST) {
        Material material = materials[triangle_materials[triangle]];
        if (material.alpha_cutoff < 0.0) return false;
        uvec3 v = triangles[triangle];
        vec3 weights = vec3(1.0 - barycentrics.x - barycentrics.y, barycentrics);
        return is_hole_of(material, interpolated(attributes[v.x], attributes[v.y], attributes[v.z], weights));
    }
    return false;
}

#include "methods/face_cluster/cluster_visibility.glsl"

// Share of the way from a node of `receiver` to a point that is free, by the one or the other.
float visibility(FaceElement receiver, Ray ray)
{
    if (CLUSTERS_BLOCK) return free_share(ray.origin, ray.origin + ray.t_max * ray.direction, 0.5 * receiver.half_extent.y);
    return is_hit(traverse(ray, true)) ? 0.0 : 1.0;
}

vec3 receiver_node(uint element, uint k) { return element_nodes[element * RULE_NODES + k]; }
// What the places around a shooter node are of all of it.
float shooter_weight(uint element, uint k) { return fits[element * FITS + IRRADIANCE_FUNCTIONS * RECEIVER_NODES + k]; }

vec3 shooter_node(uint element, uint k) { return receiver_node(element, RECEIVER_NODES + k); }

// Of the face that the node lies on.
vec3 node_normal(uint element, uint k) { return unpackSnorm4x8(node_normals[element * RULE_NODES + k]).xyz; }

// Whether the element's cluster has smaller ones below it.
bool can_split(FaceElement e) { return cluster_skips[e.cluster] != e.cluster + 1; }

// Least vector area that stands for all of an element, as a share of its area.
const float LEAST_FLAT_SHARE = 0.5;

// Irradiance vector that a receiver keeps of light 1 from a unit direction: what its vector area is not hit by but its
// faces are lies along the mean normal. From behind that alone is kept, unless the receiver has smaller ones below that
// know better.
vec3 kept_vector(FaceElement e, vec3 direction)
{
    float along = dot(e.axis_z, direction);
    if (is_bent(e) && can_split(e)) return direction;
    float beyond = projected_area(e, direction) - vector_area(e) * max(along, 0.0);
    return (along > 0.0 ? direction : vec3(0.0)) + beyond / max(vector_area(e), LEAST_FLAT_SHARE * e.area) * e.axis_z;
}

// Where a node counts as standing in its element's square: a flat one's where it is, others where the rule has them.
vec2 node_coordinates(FaceElement e, uint element, uint k)
{
    return is_flat(e) ? plane_coordinates(e, receiver_node(element, k)) : rules[k].uv;
}

// What arrived at the receiver's nodes (a column a channel), on its functions.                 [Gobbetti2003 Eq. 7]
void project(uint receiver, mat3 at_nodes[RECEIVER_NODES], out mat3 on_functions[IRRADIANCE_FUNCTIONS])
{
    [[dont_unroll]] for (uint k = 0; k < IRRADIANCE_FUNCTIONS; ++k) {
        on_functions[k] = mat3(0.0);
        [[dont_unroll]] for (uint r = 0; r < RECEIVER_NODES; ++r)
            on_functions[k] += fits[receiver * FITS + k * RECEIVER_NODES + r] * at_nodes[r];
    }
}

// The error, W: how far bounds lie from what the functions say, in the channel in which the light is strongest; at least half
// of what `passes` where some of it is blocked: functions may meet lit and unlit nodes alike, and say nothing of the border
// between.                                                                                     [Gobbetti2003 3.3.2]
float error_of(FaceElement a, uint receiver, mat3 on_functions[IRRADIANCE_FUNCTIONS], vec3 light, float least[RECEIVER_NODES], float greatest[RECEIVER_NODES], float passes)
{
    uint channel = light.x >= max(light.y, light.z) ? 0 : light.y >= light.z ? 1 : 2;
    float error = 0.5 * passes;
    [[dont_unroll]] for (uint r = 0; r < RECEIVER_NODES; ++r) {
        float said = 0.0;
        vec2 uv = node_coordinates(a, receiver, r);
        [[dont_unroll]] for (uint k = 0; k < IRRADIANCE_FUNCTIONS; ++k)
            said += basis(k, uv) * dot(a.axis_z, on_functions[k][channel]);
        said *= vector_area(a);
        error = max(error, max(said - least[r], greatest[r] - said));
    }
    return error;
}

// Adds to what the receiver got so far, in whole units: sums do not depend on their order.
void receive(uint receiver, mat3 on_functions[IRRADIANCE_FUNCTIONS], float units)
{
    [[dont_unroll]] for (uint k = 0; k < IRRADIANCE_FUNCTIONS; ++k)
        [[dont_unroll]] for (uint w = 0; w < 9; ++w) {
            int value = int(round(clamp(on_functions[k][w / 3][w % 3] * units, -2e8, 2e8)));
            if (value != 0) atomicAdd(arriving[(receiver * IRRADIANCE_FUNCTIONS + k) * 9 + w], value);
        }
    atomicAdd(pool[0].transfers, 1);
}
#endif
