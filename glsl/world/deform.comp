#version 460
#include "lib/prelude.glsl"
#include "lib/scene.glsl"
#include "lib/unit.glsl"

// One thread per vertex: morph, then skin or node transform, to world space.                 [glTF 2.0 3.7.2, 3.7.3]
// reads local_vertices, vertex_parts[vertex_count], parts, influences, palette, morph_deltas, morph_weights
// writes positions, normals, tangents [vertex_count] (m, unit, unit + handedness)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer LocalVertices { LocalVertex local_vertices[]; };
layout(set = 0, binding = 1, scalar) readonly buffer VertexParts { uint vertex_parts[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Parts { Part parts[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Influences { Influence influences[]; };    // skinned vertices
layout(set = 0, binding = 4, scalar) readonly buffer Palette { mat4x3 palette[]; };             // joints, world from mesh
layout(set = 0, binding = 5, scalar) readonly buffer MorphDeltas { MorphDelta morph_deltas[]; };
layout(set = 0, binding = 6, scalar) readonly buffer MorphWeights { float morph_weights[]; };
layout(set = 0, binding = 7, scalar) writeonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 8, scalar) writeonly buffer Normals { vec3 normals[]; };
layout(set = 0, binding = 9, scalar) writeonly buffer Tangents { vec4 tangents[]; };
layout(push_constant, scalar) uniform Params { uint vertex_count; } params;

// Largest entry 1, so that products of small or large scales stay within what floats hold.
mat3 scaled(mat3 m)
{
    vec3 size = max(abs(m[0]), max(abs(m[1]), abs(m[2])));
    float largest = max(size.x, max(size.y, size.z));
    return largest > 0.0 ? m / largest : m;
}

// Inverse transpose up to a positive factor, by cofactors: defined for singular matrices too.
mat3 normal_matrix(mat3 m)
{
    float handedness = dot(m[0], cross(m[1], m[2])) < 0.0 ? -1.0 : 1.0;
    return mat3(cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])) * handedness;
}

void main()
{
    uint v = linear_index();
    if (v >= params.vertex_count) return;
    Part part = parts[vertex_parts[v]];
    LocalVertex local = local_vertices[v];

    vec3 position = local.position, normal = local.normal, tangent = local.tangent.xyz;
    for (uint target = 0; target < part.morph_target_count; ++target) {
        float weight = morph_weights[part.morph_weight_offset + target];
        if (weight == 0.0) continue;
        MorphDelta delta = morph_deltas[part.morph_offset + target * part.vertex_count + (v - part.vertex_offset)];
        position += weight * delta.position;
        normal += weight * delta.normal;
        tangent += weight * delta.tangent;
    }

    mat4x3 world = part.world_from_local;
    mat3 normal_world = part.normal_from_local;
    float mirror = part.mirror;
    if (part.skin_offset != NO_SKIN) {
        Influence influence = influences[part.skin_offset + (v - part.vertex_offset)];
        world = mat4x3(0.0);
        for (uint k = 0; k < 8; ++k)
            if (influence.weights[k] != 0.0) world += palette[influence.joints[k]] * influence.weights[k];
        mat3 linear = scaled(mat3(world));
        normal_world = normal_matrix(linear);
        mirror = determinant(linear) < 0.0 ? -1.0 : 1.0;
    }

    positions[v] = world * vec4(position, 1.0);
    normals[v] = unit_or(normal_world * normal, local.normal);
    tangents[v] = vec4(unit_or(mat3(world) * tangent, tangent), local.tangent.w * mirror);
}
