#version 460
#include "lib/prelude.glsl"
#include "lib/hemisphere.glsl"

// One thread per leaf of a tree over triangles: its light is the mean of the elements at its corners.
// reads leaf_elements[leaf_count], emission (W m^-2 sr^-1), albedo, punctual, direct, indirect (W/m2) [element_count]
// writes emitted, reflected [leaf_count] (W/m2)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer LeafElements { uvec3 leaf_elements[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Emission { vec3 emission[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Albedo { vec3 albedo[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Punctual { vec3 punctual[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Direct { vec3 direct[]; };
layout(set = 0, binding = 5, scalar) readonly buffer IndirectIrradiance { vec3 indirect[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer Emitted { vec3 emitted[]; };
layout(set = 0, binding = 7, scalar) writeonly buffer Reflected { vec3 reflected[]; };
layout(push_constant, scalar) uniform Params { uint leaf_count; uint has_reflected; } params;

void main()
{
    uint leaf = linear_index();
    if (leaf >= params.leaf_count) return;

    uvec3 elements = leaf_elements[leaf];
    vec3 emission_sum = vec3(0.0), radiosity_sum = vec3(0.0);
    for (uint k = 0; k < 3; ++k) {
        uint element = elements[k];
        emission_sum += emission[element];
        radiosity_sum += albedo[element] * (punctual[element] + direct[element] + indirect[element]);
    }
    emitted[leaf] = (PI / 3.0) * emission_sum;
    reflected[leaf] = params.has_reflected != 0 ? radiosity_sum / 3.0 : vec3(0.0);
}
