#version 460
#include "lib/prelude.glsl"

// One thread per element: one that looks into the inside of things takes the mean of its neighbours that do not: of those
// that look the same way, where there are any, else of those that look sideways. Never from behind: at the back of a
// skirting board stand elements of the wall's other side, in the sun. Reads resolved elements and writes unresolved ones
// alone, so that it may work in place.
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

    vec3 normal = element_normals[element];
    vec3 same_way = vec3(0.0), sideways = vec3(0.0);
    uint same_way_count = 0, sideways_count = 0;
    for (uint k = ring_offsets[element]; k < ring_offsets[element + 1]; ++k) {
        uint neighbour = ring[k];
        float cosine = dot(normal, element_normals[neighbour]);
        if (is_unresolved(neighbour) || !(cosine > -SAME_WAY)) continue;
        if (cosine > SAME_WAY) {
            same_way += irradiance[neighbour];
            ++same_way_count;
        } else {
            sideways += irradiance[neighbour];
            ++sideways_count;
        }
    }
    if (same_way_count > 0) irradiance[element] = same_way / float(same_way_count);
    else if (sideways_count > 0) irradiance[element] = sideways / float(sideways_count);
}
