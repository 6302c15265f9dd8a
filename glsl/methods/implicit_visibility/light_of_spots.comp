#version 460
#include "lib/prelude.glsl"
#include "lib/sky_spot.glsl"

// One thread per element: irradiance from the bright spots of the environment that it sees.         [Dong2007 4.4]
// reads element_normals[element_count], spots[spot_count], spots_seen[element_count * ceil(spot_count / 32)] (bits)
// updates irradiance[element_count] (W/m2)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer ElementNormals { vec3 element_normals[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Spots { SkySpot spots[]; };
layout(set = 0, binding = 2, scalar) readonly buffer SpotsSeen { uint spots_seen[]; };
layout(set = 0, binding = 3, scalar) buffer Irradiance { vec3 irradiance[]; };
layout(push_constant, scalar) uniform Params { uint element_count; uint spot_count; } params;

void main()
{
    uint element = linear_index();
    if (element >= params.element_count) return;
    vec3 normal = element_normals[element], sum = vec3(0.0);
    uint words = (params.spot_count + 31) / 32;
    for (uint k = 0; k < params.spot_count; ++k) {
        bool is_seen = (spots_seen[element * words + k / 32] >> k % 32 & 1) != 0;
        if (is_seen) sum += max(dot(normal, spots[k].direction), 0.0) * spots[k].irradiance;
    }
    irradiance[element] += sum;
}
