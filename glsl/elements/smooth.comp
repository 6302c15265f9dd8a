#version 460
#include "lib/prelude.glsl"

// One thread per element: mean over itself and the neighbours that look about the same way.       [Schmitz2008 3.3, Eqs. 5-6]
// reads ring_offsets[element_count + 1], ring, element_normals, irradiance [element_count] (W/m2)
// writes smoothed[element_count] (W/m2)   shared none
// Differs from [Schmitz2008]: the ring holds every element at the same or a neighbouring place, so that a texture seam or
// a split vertex does not show.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer RingOffsets { uint ring_offsets[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Ring { uint ring[]; };
layout(set = 0, binding = 2, scalar) readonly buffer ElementNormals { vec3 element_normals[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Irradiance { vec3 irradiance[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer Smoothed { vec3 smoothed[]; };
layout(push_constant, scalar) uniform Params { uint element_count; float cos_feature_angle; } params;

void main()
{
    uint element = linear_index();
    if (element >= params.element_count) return;

    vec3 normal = element_normals[element];
    vec3 sum = irradiance[element];
    uint count = 1;
    for (uint k = ring_offsets[element]; k < ring_offsets[element + 1]; ++k) {
        uint neighbour = ring[k];
        if (!(dot(normal, element_normals[neighbour]) > params.cos_feature_angle)) continue;
        sum += irradiance[neighbour];
        ++count;
    }
    smoothed[element] = sum / float(count);
}
