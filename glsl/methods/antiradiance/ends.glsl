#ifndef ENDS
#define ENDS
// The two nodes of a link, p the receiver and q the sender, and light between them.
// The kernel binds node_texels, cosine_norms[leaf_count], bin_directions[bin_count], spread_offsets, spread, and has params.bins
// (BinParams).
#include "lib/direction_bins.glsl"
#include "lib/packed_hierarchy.glsl"
#include "methods/antiradiance/solid_angle.glsl"

const float FOUR_PI = 12.5663706143592;

// An end of a link. Nodes within one flat surface have a normal like a leaf.
struct End {
    vec3 center, normal;
    float area;
    vec3 half_u, half_v;    // of a flat one's rectangle, half of its sides
    bool is_flat;
    bool passes_behind;     // nothing is received from behind
    float norm;
};

End end_of(uint node)
{
    uvec4 texel_1 = NODE_TEXEL(node, 1), texel_3 = NODE_TEXEL(node, 3);
    uint shape = NODE_TEXEL(node, 4).y;
    End end;
    end.center = uintBitsToFloat(NODE_TEXEL(node, 0).xyz);
    end.normal = uintBitsToFloat(texel_1.xyz);
    end.area = uintBitsToFloat(texel_1.w);
    end.half_u = uintBitsToFloat(NODE_TEXEL(node, 2).xyz);
    end.half_v = uintBitsToFloat(texel_3.xyz);
    end.is_flat = shape != NONE;
    end.passes_behind = end.is_flat && (texel_3.w & BLOCKS_BEHIND) == 0;
    end.norm = end.is_flat ? cosine_norms[shape] : 0.0;
    return end;
}

// Whether light along v is on the sides of both ends that p_cos and q_cos say.
bool is_between(End p, End q, vec3 v, float p_cos, float q_cos)
{
    return !(p.is_flat && dot(p.normal, v) * p_cos <= 0.0) && !(q.is_flat && dot(q.normal, v) * q_cos <= 0.0);
}

// The bin that carries light along w, and its direction: the nearest one on the sides of both ends that w itself is on.
uint bin_between(End p, End q, vec3 w, out vec3 v)
{
    float p_cos = dot(p.normal, w), q_cos = dot(q.normal, w);
    uint middle = bin_of(w, params.bins.side);
    v = BIN_DIRECTION(middle);
    if (is_between(p, q, v, p_cos, q_cos)) return middle;
    // Nearest of all is the bin itself.
    uint last = spread_offsets[middle + 1];
    for (uint k = spread_offsets[middle] + 1; k < last; ++k) {
        v = BIN_DIRECTION(spread[k].bin);
        if (is_between(p, q, v, p_cos, q_cos)) return spread[k].bin;
    }
    return NONE;
}

// What `covered` bins' worth of light along w arrives as, by way of a bin along v: irradiance is that of w.
float weight_between(End p, End q, vec3 w, vec3 v, float covered)
{
    if (p.is_flat) covered *= abs(dot(p.normal, w)) / discrete_cosine(dot(p.normal, v), p.norm, params.bins.count);
    return q.is_flat ? covered / discrete_cosine(dot(q.normal, v), q.norm, params.bins.count) : covered;
}

const uint FRONT = 1, BACK = 2;

// Sides of the receiver that a flat sender reaches: the one that its centre is on. A rectangle is not its shape, and would light
// floors from below the walls on them. Only of what the receiver stands on, as a shelf does on a wall, much may lie on either side.
// No two then send each other light along one bin.
uint sides_reached(End q, End p, vec3 offset)
{
    if (!p.is_flat) return FRONT | BACK;
    float behind = dot(p.normal, offset), reach = abs(dot(p.normal, q.half_u)) + abs(dot(p.normal, q.half_v));
    bool is_on_both = behind > 0.0 && behind < 0.5 * reach && dot(q.normal, offset) > 0.0;
    uint sides = (behind <= 0.0 || is_on_both ? FRONT : 0u) | (behind > 0.0 ? BACK : 0u);
    return p.passes_behind ? sides & FRONT : sides;
}

// Whether light along v may go from q to p. Rectangles are not the shapes, and three that stand about an edge could send
// antiradiance around in a circle, without end: but where two face each other, light goes the way that their centres lie.
bool is_on_its_way(End q, End p, vec3 offset, vec3 v)
{
    return dot(v, offset) > 0.0 || (p.is_flat && dot(q.normal, offset) > 0.0 && dot(p.normal, offset) < 0.0);
}
#endif
