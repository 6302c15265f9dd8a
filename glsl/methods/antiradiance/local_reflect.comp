#version 460
#include "lib/prelude.glsl"
#include "lib/hierarchy.glsl"

// One thread per leaf: its irradiance from the parts, and what its sides reflect of it.     [Dachsbacher2007 4.2 local pass, Eq. 18]
// reads parts[part_count * 2 * leaf_count] (W/m2), leaves, source[2 leaf_count] (radiosity that needs no transport, W/m2, front
//       and back), leaf_albedo[2 leaf_count]
// updates radiosity[2 leaf_count] (W/m2), means[2 leaf_count] (W m^-2 sr^-1)   writes irradiance[2 leaf_count] (W/m2)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Parts { vec3 parts[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Leaves { HierarchyLeaf leaves[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Source { vec3 source[]; };
layout(set = 0, binding = 3, scalar) readonly buffer LeafAlbedo { vec3 leaf_albedo[]; };
layout(set = 0, binding = 4, scalar) buffer Radiosity { vec3 radiosity[]; };
layout(set = 0, binding = 5, scalar) buffer Means { vec3 means[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer Irradiance { vec3 irradiance[]; };
layout(push_constant, scalar) uniform Params {
    uint leaf_count;
    uint part_count;
    uint update_radiosity;      // 0: reflected light stays as it is, antiradiance alone goes on
    uint sets_floor;            // 1: what arrives now sets how far below zero later light may fall
} params;

const float PI = 3.14159265358979;

void main()
{
    uint leaf = linear_index();
    if (leaf >= params.leaf_count) return;
    bool reflects_behind = (leaves[leaf].flags & REFLECTS_BEHIND) != 0;
    vec3 front = vec3(0.0), back = vec3(0.0);
    for (uint part = 0; part < params.part_count; ++part) {
        front += parts[2 * part * params.leaf_count + leaf];
        back += parts[(2 * part + 1) * params.leaf_count + leaf];
    }
    if (params.sets_floor != 0) {
        means[2 * leaf] = max(means[2 * leaf], front / PI);
        means[2 * leaf + 1] = max(means[2 * leaf + 1], back / PI);
    }
    if (!reflects_behind) back = vec3(0.0);
    irradiance[2 * leaf] = front;
    irradiance[2 * leaf + 1] = back;
    if (params.update_radiosity == 0) return;
    radiosity[2 * leaf] = source[2 * leaf] + leaf_albedo[2 * leaf] * front;
    radiosity[2 * leaf + 1] = source[2 * leaf + 1] + (reflects_behind ? leaf_albedo[2 * leaf + 1] * back : vec3(0.0));
}
