#ifndef LIB_SENDER_MAPS
#define LIB_SENDER_MAPS
// Whether a point of a sender's texel sees another point, by the maps of that texel and of those beside it: percentage-
// closer filtering over senders.                                                                [Ritschel2008 3.2.2]
//
// Bridges, beside those of lib/surface_map.glsl:
//     vec3 surface_map_origin(uint place)      where the map of a place stands, metres
#include "lib/sender_tree.glsl"
#include "lib/surface_map.glsl"

vec3 surface_map_origin(uint place);

// Where a point of the leaf lies on it, -1/2..1/2 along either side.
vec2 place_on_leaf(SenderLeaf leaf, vec3 point)
{
    vec3 across = cross(leaf.edge_u, leaf.edge_v), offset = point - leaf.centre;
    float squared = dot(across, across);
    if (squared <= 0.0) return vec2(0.0);
    return clamp(vec2(dot(cross(offset, leaf.edge_v), across), dot(cross(leaf.edge_u, offset), across)) / squared, vec2(-0.5), vec2(0.5));
}

// `around` are the places of the texels towards +u, -u, +v and -v, its own where there is none. At a texel's border it
// counts as much as its neighbour.
float sender_maps_visibility(SurfaceMapFrame frame, uint place, uvec4 around, vec2 at, vec3 point, vec3 normal)
{
    vec2 share = abs(at);
    uint beside_u = at.x >= 0.0 ? around.x : around.y, beside_v = at.y >= 0.0 ? around.z : around.w;
    if (frame.sender_filter == 1) {
        vec2 chance = unit_interval(pcg4d(uvec4(floatBitsToUint(point), ~place)).xy);
        if (chance.x < share.x) place = beside_u;
        else if (chance.y < share.y) place = beside_v;
    }
    float own = surface_map_visibility(frame, place, surface_map_origin(place), point, normal);
    if (frame.sender_filter != 2) return own;
    // As often as the drawn one: along u first.
    vec2 weights = vec2(share.x, (1.0 - share.x) * share.y);
    float sum = (1.0 - weights.x - weights.y) * own;
    for (uint k = 0; k < 2; ++k) {
        uint beside = k == 0 ? beside_u : beside_v;
        if (beside == place) sum += weights[k] * own;
        else sum += weights[k] * surface_map_visibility(frame, beside, surface_map_origin(beside), point, normal);
    }
    return sum;
}
#endif
