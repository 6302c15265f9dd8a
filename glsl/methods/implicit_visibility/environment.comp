#version 460
#include "lib/prelude.glsl"
#include "lib/bins.glsl"
#include "lib/environment.glsl"

// One thread per leaf of a window: irradiance from the environment through its empty bins.          [Dong2007 4.4]
// reads winners[6 n n * leaf_count of the window], receivers, leaf_elements, bin_vectors[6 n n] (sr), bin_radiance[6 n n]
// (the mean over each bin along the world's axes), the environment   writes irradiance[element_count] (W/m2)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Winners { uint winners[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Receivers { Receiver receivers[]; };
layout(set = 0, binding = 2, scalar) readonly buffer LeafElements { uint leaf_elements[]; };
layout(set = 0, binding = 3, scalar) readonly buffer BinVectors { vec3 bin_vectors[]; };
layout(set = 0, binding = 4, scalar) readonly buffer BinRadiance { vec3 bin_radiance[]; };
layout(set = 0, binding = 5, scalar) readonly buffer EnvironmentInfos { EnvironmentInfo environment_info[]; };
layout(set = 0, binding = 6) uniform sampler2D environment_map;
layout(set = 0, binding = 7, scalar) writeonly buffer Irradiance { vec3 irradiance[]; };
layout(push_constant, scalar) uniform Params {
    uint first_leaf;
    uint leaf_count;    // of the window
    uint n;
    uint is_turned;     // bins are not along the world's axes: look into the map, which is as coarse as they are
} params;

vec3 environment_texel(ivec2 texel) { return texelFetch(environment_map, texel, 0).rgb; }

void main()
{
    uint local = linear_index();
    if (local >= params.leaf_count) return;
    Receiver at = receivers[params.first_leaf + local];
    vec3 normal = turn_back(at.frame, at.normal);
    EnvironmentInfo env = environment_info[0];
    vec3 sum = vec3(0.0);
    float total = 0.0;
    uint per_face = params.n * params.n;
    for (uint cell = 0; cell < per_face; ++cell) {
        vec3 in_axes = bin_vectors[FACE_OF_Z * per_face + cell];    // of all faces
        for (uint face = 0; face < 6; ++face) {
            uint bin = face * per_face + cell;
            float weight = dot(from_face(face, in_axes), normal);
            if (weight <= 0.0) continue;
            total += weight;
            if (winners[bin * params.leaf_count + local] != EMPTY_BIN) continue;
            vec3 radiance = params.is_turned == 0
                                ? bin_radiance[bin]
                                : environment_radiance(env, turn(at.frame, normalize(bin_direction(bin, params.n))));
            sum += weight * radiance;
        }
    }
    irradiance[leaf_elements[params.first_leaf + local]] = total > 0.0 ? sum * (PI / total) : vec3(0.0);
}
