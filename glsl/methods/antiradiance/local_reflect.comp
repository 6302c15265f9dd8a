#version 460
#include "lib/prelude.glsl"
#include "lib/hierarchy.glsl"

// One thread per leaf: its irradiance from the parts, what its sides reflect of it, and how much that changes what a plain one
// sends (see plain.glsl; over a side, cosine times solid angle sums to pi).     [Dachsbacher2007 4.2 local pass, Eq. 18]
// reads parts[part_count * 2 * leaf_count] (W/m2), leaves, source[2 leaf_count] (radiosity that needs no transport, W/m2, front
//       and back), leaf_albedo[2 leaf_count], glossy_of_leaf[leaf_count], scales[2 leaf_count] (of what links bring)
// updates radiosity[2 leaf_count] (W/m2), means[2 leaf_count] (W m^-2 sr^-1)   writes irradiance[2 leaf_count] (W/m2),
//         light_changes[leaf_count] (W: how much the light that plain fronts send changed, how much there is)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Parts { vec3 parts[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Leaves { HierarchyLeaf leaves[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Source { vec3 source[]; };
layout(set = 0, binding = 3, scalar) readonly buffer LeafAlbedo { vec3 leaf_albedo[]; };
layout(set = 0, binding = 4, scalar) buffer Radiosity { vec3 radiosity[]; };
layout(set = 0, binding = 5, scalar) buffer Means { vec3 means[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer Irradiance { vec3 irradiance[]; };
layout(set = 0, binding = 7, scalar) readonly buffer GlossyOfLeaf { uint glossy_of_leaf[]; };
layout(set = 0, binding = 8, scalar) writeonly buffer LightChanges { vec2 light_changes[]; };
layout(set = 0, binding = 9, scalar) readonly buffer Scales { float scales[]; };
layout(push_constant, scalar) uniform Params {
    uint leaf_count;
    uint part_count;
    uint is_linked;             // 0: the environment's light is in it, which no link brought
    uint update_radiosity;      // 0: reflected light stays as it is, antiradiance alone goes on
    uint sets_floor;            // 1: what arrives now sets how far below zero later light may fall
    uint is_undamped;
} params;

#include "methods/antiradiance/plain.glsl"

const float PI = 3.14159265358979;

void main()
{
    uint leaf = linear_index();
    if (leaf >= params.leaf_count) return;
    uint flags = leaves[leaf].flags;
    bool reflects_behind = (flags & REFLECTS_BEHIND) != 0;
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
    if (params.is_linked != 0) {
        front *= scales[2 * leaf];
        back *= scales[2 * leaf + 1];
    }
    irradiance[2 * leaf] = front;
    irradiance[2 * leaf + 1] = back;
    vec3 before = radiosity[2 * leaf], after = before;
    if (params.update_radiosity != 0) {
        after = source[2 * leaf] + leaf_albedo[2 * leaf] * front;
        radiosity[2 * leaf] = after;
        radiosity[2 * leaf + 1] = source[2 * leaf + 1] + (reflects_behind ? leaf_albedo[2 * leaf + 1] * back : vec3(0.0));
    }
    vec3 change = abs(after - before), sent = abs(after);
    light_changes[leaf] = is_plain(flags, glossy_of_leaf[leaf])
        ? leaves[leaf].area * vec2(change.r + change.g + change.b, sent.r + sent.g + sent.b) : vec2(0.0);
}
