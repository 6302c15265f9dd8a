#version 460
#include "lib/prelude.glsl"
#include "lib/hierarchy.glsl"

// One thread per leaf: the light it sends before any is transported. First what it emits itself, where that is carried
// by links; then what it reflects of all direct light.                                         [Dachsbacher2007 3.3]
// reads leaves, members, back_elements[vertex_count], area (m2), albedo, emission (W m^-2 sr^-1), is_sampled, direct_irradiance
//       (W/m2) [element_count], linked_irradiance[2 leaf_count] (W/m2: direct light that came along links, front and back)
// writes source, radiosity [2 leaf_count] (W/m2)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Leaves { HierarchyLeaf leaves[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Albedo { vec3 albedo[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Emission { vec3 emission[]; };
layout(set = 0, binding = 3, scalar) readonly buffer IsSampled { uint is_sampled[]; };
layout(set = 0, binding = 4, scalar) readonly buffer DirectIrradiance { vec3 direct_irradiance[]; };
layout(set = 0, binding = 5, scalar) readonly buffer LinkedIrradiance { vec3 linked_irradiance[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer Source { vec3 source[]; };
layout(set = 0, binding = 7, scalar) writeonly buffer Radiosity { vec3 radiosity[]; };
layout(set = 0, binding = 8, scalar) readonly buffer Members { uint members[]; };
layout(set = 0, binding = 9, scalar) readonly buffer BackElements { uint back_elements[]; };
layout(set = 0, binding = 10, scalar) readonly buffer Area { float area[]; };
layout(push_constant, scalar) uniform Params {
    uint leaf_count;
    uint is_emission;       // 1: emitted light, 0: reflected direct light
} params;

const float PI = 3.14159265358979;

vec3 source_of(uint element, uint slot)
{
    if (element == NONE) return vec3(0.0);
    if (params.is_emission != 0) return is_sampled[element] != 0 ? vec3(0.0) : PI * emission[element];
    return albedo[element] * (direct_irradiance[element] + linked_irradiance[slot]);
}

void main()
{
    uint leaf = linear_index();
    if (leaf >= params.leaf_count) return;
    uint first = leaves[leaf].first_member, last = first + leaves[leaf].member_count;
    // Of its members, by area.
    vec3 front = vec3(0.0), back = vec3(0.0);
    float area_sum = 0.0;
    for (uint member = first; member < last; ++member) {
        uint vertex = members[member];
        front += area[vertex] * source_of(vertex, 2 * leaf);
        back += area[vertex] * source_of(back_elements[vertex], 2 * leaf + 1);
        area_sum += area[vertex];
    }
    float inverse = area_sum > 0.0 ? 1.0 / area_sum : 0.0;
    source[2 * leaf] = inverse * front;
    source[2 * leaf + 1] = inverse * back;
    radiosity[2 * leaf] = inverse * front;
    radiosity[2 * leaf + 1] = inverse * back;
}
