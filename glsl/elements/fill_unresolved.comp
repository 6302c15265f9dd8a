#version 460
#include "lib/prelude.glsl"

// One thread per element: one that looks into the inside of things takes the mean of its neighbours that do not, and that
// look about the same way: behind a skirting board stands one of the wall's other side, in the sun. Reads resolved elements
// and writes unresolved ones alone, so that it may work in place.
// reads outcomes[element_count] (blocked rays in the lower half), ring_offsets[element_count + 1], ring,
// element_normals[element_count]   updates irradiance[element_count] (W/m2)   shared none
// Differs from [Schmitz2008]: there a vertex inside another object stays black and darkens the triangles around it.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Outcomes { uint outcomes[]; };
layout(set = 0, binding = 1, scalar) readonly buffer RingOffsets { uint ring_offsets[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Ring { uint ring[]; };
layout(set = 0, binding = 3, scalar) readonly buffer ElementNormals { vec3 element_normals[]; };
layout(set = 0, binding = 4, scalar) buffer Irradiance { vec3 irradiance[]; };
layout(push_constant, scalar) uniform Params { uint element_count; uint ray_count; } params;

const float SAME_WAY = 0.5;     // cosine between normals, at least

bool is_unresolved(uint element) { return (outcomes[element] & 0xffffu) * 2 > params.ray_count; }

void main()
{
    uint element = linear_index();
    if (element >= params.element_count || !is_unresolved(element)) return;

    vec3 normal = element_normals[element], sum = vec3(0.0);
    uint count = 0;
    for (uint k = ring_offsets[element]; k < ring_offsets[element + 1]; ++k) {
        if (is_unresolved(ring[k]) || !(dot(normal, element_normals[ring[k]]) > SAME_WAY)) continue;
        sum += irradiance[ring[k]];
        ++count;
    }
    if (count > 0) irradiance[element] = sum / float(count);
}
