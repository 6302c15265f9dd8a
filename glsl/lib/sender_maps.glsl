#ifndef LIB_SENDER_MAPS
#define LIB_SENDER_MAPS
// By which maps a point of a sender's texel sees: that of the texel, and those of the texels beside it. Percentage-closer
// filtering over senders.                                                                       [Ritschel2008 3.2.2]
//
// Bridge, beside those of lib/surface_map.glsl: where the map at a place stands, metres.
//     vec3 map_origin(uint place)
#include "lib/sender_tree.glsl"
#include "lib/surface_map.glsl"

// Of a leaf: the place of its texel's map, and of those of the texels towards +u, -u, +v and -v, its own where there is none.
struct LeafMaps {
    uint place;
    uvec4 around;
};

// Where a point of the leaf lies on it, -1/2..1/2 along either side.
vec2 place_on_leaf(SenderLeaf leaf, vec3 point)
{
    return clamp(sides_on_leaf(leaf, point), vec2(-0.5), vec2(0.5));
}

// Places of the maps that are asked, and what each answer counts; the weights add up to one.
struct SenderPlaces {
    uint count;
    uvec3 place;
    vec3 weight;
};

// At a texel's border it counts as much as its neighbour. `point` is what is seen: it tells the chances.
SenderPlaces sender_places(SurfaceMapFrame frame, LeafMaps maps, vec2 at, vec3 point)
{
    uint place = maps.place;
    uvec4 around = maps.around;
    vec2 share = abs(at);
    uint beside_u = at.x >= 0.0 ? around.x : around.y, beside_v = at.y >= 0.0 ? around.z : around.w;
    if (frame.sender_filter == 1) {
        vec2 chance = unit_interval(pcg4d(uvec4(floatBitsToUint(point), ~place)).xy);
        if (chance.x < share.x) place = beside_u;
        else if (chance.y < share.y) place = beside_v;
    }
    // As often as the drawn one: along u first.
    float along_v = (1.0 - share.x) * share.y;
    if (frame.sender_filter == 2)
        return SenderPlaces(3, uvec3(place, beside_u, beside_v), vec3(1.0 - share.x - along_v, share.x, along_v));
    return SenderPlaces(1, uvec3(place), vec3(1.0, 0.0, 0.0));
}

vec3 map_origin(uint place);

// What the maps of a leaf tell of a point that one of the leaf sends to.
MapView leaf_view(SurfaceMapFrame frame, LeafMaps maps, vec2 at, vec3 point, vec3 normal)
{
    SenderPlaces asked = sender_places(frame, maps, at, point);
    MapView all = MapView(0.0, 1.0);
    for (uint k = 0; k < asked.count; ++k) {
        MapView view = surface_map_view(frame, asked.place[k], map_origin(asked.place[k]), point, normal);
        all = MapView(all.seen + asked.weight[k] * view.seen, min(all.told, view.told));
    }
    return all;
}
#endif
