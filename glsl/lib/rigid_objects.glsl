#ifndef LIB_RIGID_OBJECTS
#define LIB_RIGID_OBJECTS
// Whether two points of objects that move rigidly see each other: by the surface shadow maps of their own objects and the
// outside maps of all others, each in the pose in which its maps were made.                        [Ritschel2008 3.3]
//
// Bridges, beside those of lib/surface_map.glsl:
//     RigidObject rigid_object(uint i)
//     uint rigid_word(uint i)          what stays: a header of offsets (RIGID_*), then tables
#include "lib/outside_map.glsl"
#include "lib/surface_map.glsl"

struct RigidObject {
    vec4 rest_from_world_x;     // rows: where the object's points were at rest
    vec4 rest_from_world_y;
    vec4 rest_from_world_z;
    vec3 centre;                // of its ball at rest, metres
    float radius;
    uint asks_rays;             // bit k: ways to object k are asked by rays
};

RigidObject rigid_object(uint i);
uint rigid_word(uint i);

// Words of the header.
const uint RIGID_COUNT = 0;             // objects; 0 is all that stands still
const uint RIGID_LEAF_OBJECTS = 1;
const uint RIGID_TEXEL_OBJECTS = 2;
const uint RIGID_TEXEL_PLACES = 3;
const uint RIGID_RUN_OFFSETS = 4;       // of the outside maps: object after object, pixel after pixel
const uint RIGID_RUNS = 5;
const uint RIGID_RESOLUTION = 6;
const uint RIGID_DIRECTIONS = 7;
const uint RIGID_TEXEL_AT = 8;          // of the squares of the atlas, row by row
const uint RIGID_CORNERS = 9;           // of each triangle in the atlas, fronts, then backs: six floats
const uint RIGID_ATLAS_SIDE = 10;
const uint RIGID_TRIANGLE_COUNT = 11;
const uint RIGID_TRIANGLE_OBJECTS = 12;

vec3 at_rest(RigidObject o, vec3 p)
{
    vec4 q = vec4(p, 1.0);
    return vec3(dot(o.rest_from_world_x, q), dot(o.rest_from_world_y, q), dot(o.rest_from_world_z, q));
}

vec3 direction_at_rest(RigidObject o, vec3 d)
{
    return vec3(dot(o.rest_from_world_x.xyz, d), dot(o.rest_from_world_y.xyz, d), dot(o.rest_from_world_z.xyz, d));
}

uint outside_depth(uint place, uint pixel)
{
    uint offsets = rigid_word(RIGID_RUN_OFFSETS), runs = rigid_word(RIGID_RUNS);
    uint low = rigid_word(offsets + pixel), high = rigid_word(offsets + pixel + 1);
    while (high - low > 1) {
        uint middle = low + high >> 1;
        if (rigid_word(runs + middle) >> 16 <= place) low = middle;
        else high = middle;
    }
    return rigid_word(runs + low) & 0xffffu;
}

// Whether an object blocks the way between two points outside its hull, both at its rest; `shift` in -1/2..1/2 draws the
// pixel and the direction among those around.
bool outside_blocks(uint object, RigidObject o, vec3 a, vec3 b, vec4 shift)
{
    vec3 along = b - a;
    float nearest = clamp(dot(o.centre - a, along) / max(dot(along, along), 1e-30), 0.0, 1.0);
    vec3 beside = a + nearest * along - o.centre;
    if (dot(beside, beside) >= o.radius * o.radius) return false;

    vec3 size = abs(along);
    uint axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    if (along[axis] < 0.0) {
        vec3 swapped = a;
        a = b;
        b = swapped;
        along = -along;
    }
    uint directions = rigid_word(RIGID_DIRECTIONS), resolution = rigid_word(RIGID_RESOLUTION);
    vec2 cell = clamp(cube_place(along, 2 * axis, directions) + shift.zw, vec2(0.0), vec2(float(directions) - 1.0));
    uvec2 whole = uvec2(cell);
    uint place = outside_walk((axis * directions + whole.y) * directions + whole.x, directions);
    mat3 frame = outside_frame(place, directions);
    vec2 at = (vec2(dot(beside, frame[0]), dot(beside, frame[1])) / o.radius * 0.5 + 0.5) * float(resolution) + shift.xy;
    if (any(lessThan(at, vec2(0.0))) || any(greaterThanEqual(at, vec2(float(resolution))))) return false;
    uvec2 pixel = uvec2(at);
    uint depth = outside_depth(place, (object * resolution + pixel.y) * resolution + pixel.x);
    if (depth == OUTSIDE_FREE) return false;
    float before = outside_code(dot(a - o.centre, frame[2]) / o.radius), behind = outside_code(dot(b - o.centre, frame[2]) / o.radius);
    return before < float(depth) && float(depth) < behind;
}

// A point in the present pose, with the texel whose map sees for it.
struct RigidPoint {
    vec3 position;
    vec3 normal;
    uint object;
    uint place;     // of its map
    vec3 from;      // where that stands, at rest
};

bool rigid_asks_rays(uint object, uint other) { return (rigid_object(object).asks_rays >> other & 1u) != 0; }

// Share of the way from a sender to a receiver that is free.
float rigid_visibility(SurfaceMapFrame frame, RigidPoint sender, RigidPoint receiver)
{
    RigidObject o = rigid_object(sender.object);
    float free = surface_map_view(frame, sender.place, sender.from, at_rest(o, receiver.position), direction_at_rest(o, receiver.normal)).seen;
    if (receiver.object != sender.object && free > 0.0) {
        o = rigid_object(receiver.object);
        free *= surface_map_view(frame, receiver.place, receiver.from, at_rest(o, sender.position), direction_at_rest(o, sender.normal)).seen;
    }
    vec4 shift = unit_interval(pcg4d(uvec4(floatBitsToUint(receiver.position), sender.place))) - 0.5;
    if (frame.filter_mode == 0) shift = vec4(0.0);
    uint count = rigid_word(RIGID_COUNT);
    for (uint k = 0; k < count && free > 0.0; ++k) {
        if (k == sender.object || k == receiver.object) continue;
        o = rigid_object(k);
        if (outside_blocks(k, o, at_rest(o, sender.position), at_rest(o, receiver.position), shift)) free = 0.0;
    }
    return free;
}

// Pixels around a look-up from outside that must agree: the direction of a map lies up to half a cell's diagonal from the
// way's own, which moves what stands at the rim of the object's ball by 2.8 of its 64 pixels.
const float OUTSIDE_DOUBT = 3.5;

// A look-up of five pixels in the map of the way's own direction, then of the pixel itself in those of four others around.
vec4 outside_shift(uint look_up)
{
    if (look_up == 0) return vec4(0.0);
    vec2 side = vec2(look_up & 1, look_up >> 1 & 1) - 0.5;
    return look_up < 5 ? vec4(2.0 * OUTSIDE_DOUBT * side, 0.0, 0.0) : vec4(0.0, 0.0, side);
}

// Whether all that the maps tell of the way from a sender to a receiver is beyond doubt: the four pixels around agree in
// either's map, and so do the pixels and directions around in the maps from outside; `is_free` is what they say.
bool rigid_is_sure(SurfaceMapFrame frame, RigidPoint sender, RigidPoint receiver, out bool is_free)
{
    RigidObject o = rigid_object(sender.object);
    frame = asking_four(frame);
    MapView view = surface_map_view(frame, sender.place, sender.from, at_rest(o, receiver.position), direction_at_rest(o, receiver.normal));
    if (!view_is_sure(view)) return false;
    if (view.seen > 0.5 && receiver.object != sender.object) {
        o = rigid_object(receiver.object);
        view = surface_map_view(frame, receiver.place, receiver.from, at_rest(o, sender.position), direction_at_rest(o, sender.normal));
        if (!view_is_sure(view)) return false;
    }
    is_free = view.seen > 0.5;
    uint count = rigid_word(RIGID_COUNT);
    for (uint k = 0; k < count && is_free; ++k) {
        if (k == sender.object || k == receiver.object) continue;
        o = rigid_object(k);
        vec3 a = at_rest(o, sender.position), b = at_rest(o, receiver.position);
        uint blocked = 0;
        for (uint look_up = 0; look_up < 9; ++look_up)
            if (outside_blocks(k, o, a, b, outside_shift(look_up))) ++blocked;
        if (blocked != 0 && blocked != 9) return false;
        is_free = blocked == 0;
    }
    return true;
}

// The texel's index under a point of a triangle, or NO_SENDER.
uint rigid_texel(uint triangle, vec3 weights, bool is_back)
{
    uint corners = rigid_word(RIGID_CORNERS) + 6 * (triangle + (is_back ? rigid_word(RIGID_TRIANGLE_COUNT) : 0u));
    vec2 at = vec2(0.0);
    for (uint k = 0; k < 3; ++k)
        at += weights[k] * uintBitsToFloat(uvec2(rigid_word(corners + 2 * k), rigid_word(corners + 2 * k + 1)));
    uint side = rigid_word(RIGID_ATLAS_SIDE);
    // At a border rounding may step beside it.
    for (uint k = 0; k < 9; ++k) {
        ivec2 beside = k == 0 ? ivec2(0) : ivec2(int(k < 5 ? k - 1 : k) % 3 - 1, int(k < 5 ? k - 1 : k) / 3 - 1);
        ivec2 square = clamp(ivec2(floor(at)) + beside, ivec2(0), ivec2(int(side) - 1));
        uint texel = rigid_word(rigid_word(RIGID_TEXEL_AT) + uint(square.y) * side + uint(square.x));
        if (texel != 0xffffffffu) return texel;
    }
    return 0xffffffffu;
}
#endif
