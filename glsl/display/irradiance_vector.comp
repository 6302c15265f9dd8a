#version 460
#include "lib/prelude.glsl"
#include "display/seen.glsl"
#include "lib/cluster_basis.glsl"
#include "lib/leaf_light.glsl"

// One thread per pixel: all light but the punctual one, by the vector irradiance of the leaf element seen there. Each
// channel shines along its own vector.                                                 [Gobbetti2003 3.5, Eq. 10]
// reads the G-buffer, triangles, positions, normals, leaves, triangle_leaves, direct_irradiance and
//       indirect_irradiance (per leaf and function), neighbours (rows of leaves), colors (per leaf)
// updates direct, indirect [pixel_count]   shared none
layout(set = 0, binding = 8, scalar) readonly buffer Normals { vec3 normals[]; };
layout(set = 0, binding = 9, scalar) readonly buffer Leaves { LeafElement leaves[]; };
layout(set = 0, binding = 10, scalar) readonly buffer TriangleLeaves { uvec2 triangle_leaves[]; };
layout(set = 0, binding = 11, scalar) readonly buffer DirectIrradiance { SharedVectors direct_irradiance[]; };
layout(set = 0, binding = 12, scalar) readonly buffer IndirectIrradiance { SharedVectors indirect_irradiance[]; };
layout(set = 0, binding = 13, scalar) readonly buffer Colors { vec3 colors[]; };
layout(set = 0, binding = 14, scalar) buffer Direct { vec3 direct[]; };
layout(set = 0, binding = 15, scalar) buffer Indirect { vec3 indirect[]; };
layout(set = 0, binding = 16, scalar) readonly buffer NeighbourOffsets { uint neighbour_offsets[]; };  // per leaf, and one more
layout(set = 0, binding = 17, scalar) readonly buffer Neighbours { uint neighbours[]; };
layout(constant_id = 0) const uint IRRADIANCE_FUNCTIONS = 3u;
// eye: position and 1, or the direction to an orthographic eye and 0; weight: of this sample of the pixel.
layout(push_constant, scalar) uniform Params {
    vec4 eye;
    float weight;
    float unit;             // of irradiance, W/m2
    float reach;            // of a leaf's light over its border, in its shorter half sides
    float least_alpha;      // lobes are at least so wide: one direction stands for all light
    uint per_vertex;        // shade at the triangle's corners and interpolate
    uint shows_colors;      // unlit
} params;

LeafElement leaf_element(uint leaf) { return leaves[leaf]; }
uvec2 leaf_row(uint leaf) { return params.reach > 0.0 ? uvec2(neighbour_offsets[leaf], neighbour_offsets[leaf + 1]) : uvec2(0); }
uint leaf_neighbour(uint index) { return neighbours[index]; }

void leaf_vectors(uint leaf, vec2 uv, out mat3 direct, out mat3 indirect)
{
    direct = indirect = mat3(0.0);
    for (uint k = 0; k < IRRADIANCE_FUNCTIONS; ++k) {
        float b = basis(k, uv);
        direct += b * unpacked(direct_irradiance[leaf * IRRADIANCE_FUNCTIONS + k], params.unit);
        indirect += b * unpacked(indirect_irradiance[leaf * IRRADIANCE_FUNCTIONS + k], params.unit);
    }
}

// Radiance towards the eye of light along the columns of `vectors`.
vec3 radiance(Surface s, vec3 to_eye, mat3 vectors)
{
    vec3 sum = vec3(0.0);
    for (uint channel = 0; channel < 3; ++channel) {
        float size = length(vectors[channel]), along = dot(s.normal, vectors[channel]);
        if (along > 0.0) sum[channel] = brdf_value(s, to_eye, vectors[channel] / size)[channel] * along;
    }
    return sum;
}

void shade(Surface s, uint leaf, vec3 point, out vec3 direct_radiance, out vec3 indirect_radiance)
{
    mat3 d, i;
    light_on_leaf(leaf, point, params.reach, d, i);
    vec3 to_eye = params.eye.w == 0.0 ? params.eye.xyz : normalize(params.eye.xyz - point);
    direct_radiance = radiance(s, to_eye, d);
    indirect_radiance = radiance(s, to_eye, i);
}

void main()
{
    ivec2 pixel;
    uint index;
    if (!is_in_picture(pixel, index)) return;
    Seen seen;
    if (!is_seen(pixel, params.eye, seen) || (!seen.surface.reflects && params.shows_colors == 0)) return;

    uvec2 sides = triangle_leaves[seen.triangle];
    uint leaf = seen.is_back && sides.y != NO_LEAF ? sides.y : sides.x;
    if (leaf == NO_LEAF) return;

    Surface s = seen.surface;
    s.alpha = max(s.alpha, params.least_alpha);
    if (params.shows_colors != 0) {
        direct[index] += params.weight * colors[leaf];
        return;
    }
    vec3 direct_sum, indirect_sum;
    if (params.per_vertex == 0) {
        shade(s, leaf, seen.position, direct_sum, indirect_sum);
    } else {
        direct_sum = indirect_sum = vec3(0.0);
        for (uint k = 0; k < 3; ++k) {
            uint vertex = seen.vertices[k];
            s.normal = seen.is_back ? -normals[vertex] : normals[vertex];
            vec3 d, i;
            shade(s, leaf, positions[vertex], d, i);
            direct_sum += seen.weights[k] * d;
            indirect_sum += seen.weights[k] * i;
        }
    }
    direct[index] += params.weight * direct_sum;
    indirect[index] += params.weight * indirect_sum;
}
