#version 460
#include "lib/prelude.glsl"
#include "lib/hierarchy.glsl"

// One thread per leaf: what its sides reflect, the mean over its members by area.
// reads leaves, members, back_elements[vertex_count], area (m2), albedo [element_count]
// writes leaf_albedo[2 leaf_count] (front and back)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Leaves { HierarchyLeaf leaves[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Members { uint members[]; };
layout(set = 0, binding = 2, scalar) readonly buffer BackElements { uint back_elements[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Area { float area[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Albedo { vec3 albedo[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer LeafAlbedo { vec3 leaf_albedo[]; };
layout(push_constant, scalar) uniform Params { uint leaf_count; } params;

void main()
{
    uint leaf = linear_index();
    if (leaf >= params.leaf_count) return;
    uint first = leaves[leaf].first_member, last = first + leaves[leaf].member_count;
    vec3 front = vec3(0.0), back = vec3(0.0);
    float area_sum = 0.0;
    for (uint member = first; member < last; ++member) {
        uint vertex = members[member], behind = back_elements[vertex];
        front += area[vertex] * albedo[vertex];
        if (behind != NONE) back += area[vertex] * albedo[behind];
        area_sum += area[vertex];
    }
    float inverse = area_sum > 0.0 ? 1.0 / area_sum : 0.0;
    leaf_albedo[2 * leaf] = inverse * front;
    leaf_albedo[2 * leaf + 1] = inverse * back;
}
