#ifndef LIB_LEAF_LIGHT
#define LIB_LEAF_LIGHT
// Vector irradiance at a point of a leaf: the mean of all leaves that reach it. A leaf counts fully within its box, less
// and less up to its reach over the border, and the more the smaller it is: so the light has no steps where leaves meet,
// and small ones keep the detail that they were made for.
//
// Bridges: the kernel binds the tables of a solution.
//     LeafElement leaf_element(uint leaf)
//     uvec2 leaf_row(uint leaf)               first and end of the leaves beside it
//     uint leaf_neighbour(uint index)
//     void leaf_vectors(uint leaf, vec2 uv, out mat3 direct, out mat3 indirect)      W/m2, a column a channel
#include "lib/leaf_element.glsl"

LeafElement leaf_element(uint leaf);
uvec2 leaf_row(uint leaf);
uint leaf_neighbour(uint index);
void leaf_vectors(uint leaf, vec2 uv, out mat3 direct, out mat3 indirect);

// 1 / m2; `reach` in shorter half sides.
float leaf_weight(LeafElement e, vec3 point, float reach)
{
    vec3 d = point - e.center, axis_z = cross(e.axis_x, e.axis_y);
    vec3 over = abs(vec3(dot(d, e.axis_x), dot(d, e.axis_y), dot(d, axis_z))) - e.half_extent;
    float farthest = max(over.x, max(over.y, over.z)), limit = reach * min(e.half_extent.x, e.half_extent.y);
    float share = limit > 0.0 ? clamp(1.0 - farthest / limit, 0.0, 1.0) : 0.0;
    return share / max(4.0 * e.half_extent.x * e.half_extent.y, 1e-30);
}

void light_on_leaf(uint leaf, vec3 point, float reach, out mat3 direct, out mat3 indirect)
{
    LeafElement own = leaf_element(leaf);
    leaf_vectors(leaf, clamp(plane_coordinates(own, point), 0.0, 1.0), direct, indirect);
    // The leaf that holds the point counts whatever rounding says.
    float sum = max(leaf_weight(own, point, reach), 1e-6 / max(own.half_extent.x * own.half_extent.y, 1e-30));
    direct *= sum;
    indirect *= sum;
    uvec2 row = leaf_row(leaf);
    for (uint k = row.x; k < row.y; ++k) {
        uint other = leaf_neighbour(k);
        LeafElement e = leaf_element(other);
        float weight = leaf_weight(e, point, reach);
        if (weight <= 0.0) continue;
        mat3 d, i;
        leaf_vectors(other, clamp(plane_coordinates(e, point), 0.0, 1.0), d, i);
        direct += weight * d;
        indirect += weight * i;
        sum += weight;
    }
    direct /= sum;
    indirect /= sum;
}
#endif
