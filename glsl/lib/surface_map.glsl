#ifndef LIB_SURFACE_MAP
#define LIB_SURFACE_MAP
// Whether a texel of the atlas sees a point, by its compressed depth cube map.                  [Ritschel2008 3.2]
//
// Bridges: the kernel binds the runs of all pixels, as texels of four words.
//     uvec4 surface_offset_texel(uint i)     marked: of each pixel the number of its first run; from firsts_at 112 bits,
//                                            set where a run starts, and 16 for how many of its pixel's do before;
//                                            else where runs of three of the pixels' blocks start, and where the last ends
//     uvec4 surface_run_texel(uint i)        depths, two a word; not marked: from firsts_at where runs start in their blocks
#include "lib/cube_map.glsl"
#include "lib/random.glsl"

uvec4 surface_offset_texel(uint i);
uvec4 surface_run_texel(uint i);

struct SurfaceMapFrame {
    uint resolution;        // pixels a side of a face
    float codes_per_metre;
    uint filter_mode;       // 0: the pixel itself, 1: one of four around, drawn by its share, 2: all four
    uint sender_filter;     // of the sender's texel and those beside it: 0, 1, 2 likewise
    uint block_bits;        // places of a block are 2 to this, 8 or 16; 0: 112, marked
    uint block_count;
    uint firsts_at;         // texels before those that tell where runs start, of either table
    float near_share;       // of a point's distance: what is closer before it than that does not count; a ray looks there
};

// What a map tells of a point: the share of it that is seen, and the share of the way, from the map on, that this is true of.
struct MapView {
    float seen;
    float told;
};

uint word_of(uvec4 texel, uint k) { return k < 2 ? (k == 0 ? texel.x : texel.y) : (k == 2 ? texel.z : texel.w); }

// The run that holds at a place of the sequence, by the marks: as many start at it or before as bits are set up to it.
uint marked_run(SurfaceMapFrame frame, uint place, uint pixel)
{
    uint block = place / 112u, within = place - 112u * block;
    uvec4 marks = surface_offset_texel(frame.firsts_at + pixel * frame.block_count + block);
    uint before = word_of(surface_offset_texel(pixel >> 2), pixel & 3) + (marks.w >> 16);
    const uvec4 starts = uvec4(0, 32, 64, 96);
    ivec4 set = bitCount(marks & uvec4(0xffffffffu) >> 31 - min(max(uvec4(within), starts) - starts, 31u));
    return before + set.x + (within < 32 ? 0 : set.y) + (within < 64 ? 0 : set.z) + (within < 96 ? 0 : set.w) - 1;
}

// The same by search for the last run of the place's block that starts at it or before: first among texels of 16 (or 8)
// runs, then within one. A fetch costs more than the four steps that it saves.
uint searched_run(SurfaceMapFrame frame, uint place, uint pixel)
{
    uint bits = frame.block_bits, mask = (1u << bits) - 1, shift = bits == 8 ? 4 : 3;
    uint block = pixel * frame.block_count + (place >> bits), within = place & mask;
    uvec4 starts_at = surface_offset_texel(block / 3);
    uint low = word_of(starts_at, block % 3), high = word_of(starts_at, block % 3 + 1);
    uint texel = low >> shift, last = high - 1 >> shift;
    while (texel < last) {
        uint middle = texel + last + 1 >> 1;
        if ((surface_run_texel(frame.firsts_at + middle).x & mask) <= within) texel = middle;
        else last = middle - 1;
    }
    uvec4 firsts = surface_run_texel(frame.firsts_at + texel);
    low = max(low, texel << shift);
    high = min(high, texel + 1 << shift);
    // low's run starts at or before the place, high's after it.
    for (uint k = 0; k < 4; ++k) {
        uint middle = low + high >> 1, in_texel = middle & (1u << shift) - 1, per_word = shift - 2;
        uint word = word_of(firsts, in_texel >> per_word);
        bool starts = (word >> bits * (in_texel & (1u << per_word) - 1) & mask) <= within;
        low = starts ? middle : low;
        high = starts ? high : middle;
    }
    return low;
}

uint surface_map_depth(SurfaceMapFrame frame, uint place, uint pixel)
{
    uint run = frame.block_bits == 0 ? marked_run(frame, place, pixel) : searched_run(frame, place, pixel);
    return word_of(surface_run_texel(run >> 3), run >> 1 & 3) >> 16 * (run & 1) & 0xffffu;
}

// Maps that rays look after within so many widths of a pixel of the point: there a map cannot tell what lies before an edge
// from what lies behind it, and neither hides nor shows. No finer depth would tell: through a pixel that sees a floor before a
// wall, a point of that floor behind the wall lies in the plane that is seen. Depths that stand on the first surface itself take
// a fiftieth of such light away.
// Differs from [Ritschel2008]: there maps alone are asked, up to the point.
SurfaceMapFrame looked_after(SurfaceMapFrame frame, float pixels)
{
    frame.near_share = min(pixels * 2.0 / float(frame.resolution), 1.0);
    return frame;
}

// The share of the way, from the point on, that such a ray takes past what the map told of: depths stand up to a pixel's width
// behind what they tell of.
float looked_after_share(SurfaceMapFrame frame, float told) { return 1.0 - told / (1.0 + 2.0 / float(frame.resolution)); }

// Widths of a pixel by which the point's plane may lie off the point's own distance.
const float FARTHEST_PLANE = 16.0;

// What is asked: a point with the unit normal of its surface, from where the map stands.
struct SurfaceMapSight {
    vec3 normal;
    float height;       // of the point's plane over the map, metres
    float distance_to;  // metres
};

// What the map at `place` tells of the point's surface through a pixel. Depths are of the pixel's own ray: where that meets
// the surface's plane is compared with what it met first, so that no slope needs a bias. A plane that the ray meets far
// from the point, or never, tells nothing of the surface there: then the point's own distance counts.
// Differs from [Ritschel2008]: they compare the point's distance, with a bias.
MapView surface_pixel_view(SurfaceMapFrame frame, SurfaceMapSight sight, uint place, uint face, uvec2 at)
{
    float lean = dot(sight.normal, cube_pixel_direction(face, at, frame.resolution));
    float along = sight.height / (lean == 0.0 ? 1e-30 : lean);
    float width = FARTHEST_PLANE / float(frame.resolution) * sight.distance_to;
    if (!(abs(along - sight.distance_to) <= width)) along = sight.distance_to;
    uint pixel = cube_pixel_index(face, at, frame.resolution);
    float depth = float(surface_map_depth(frame, place, pixel)), near = along * (1.0 - frame.near_share);
    bool is_seen = min(near * frame.codes_per_metre, 65533.0) <= depth;
    // What only the share left out shows may as well be hidden farther off by what leans away from the pixel's ray.
    bool is_doubtful = is_seen && min(along * frame.codes_per_metre, 65533.0) > depth;
    return MapView(is_seen ? 1.0 : 0.0, is_doubtful ? 0.0 : min(near / sight.distance_to, 1.0 - frame.near_share));
}

// What the map at `place`, which stands at `origin`, tells of a point; unfiltered, all of it is seen or nothing.
MapView surface_map_view(SurfaceMapFrame frame, uint place, vec3 origin, vec3 point, vec3 normal)
{
    vec3 d = point - origin;
    SurfaceMapSight sight = SurfaceMapSight(normal, dot(normal, d), sqrt(dot(d, d)));
    uint face = cube_face(d);
    uint resolution = frame.resolution;
    vec2 at = cube_place(d, face, resolution);
    if (frame.filter_mode < 2) {
        // A place drawn from a pixel's width around falls into each of the four as often as they share in it.
        if (frame.filter_mode == 1)
            at += unit_interval(pcg4d(uvec4(floatBitsToUint(point), place)).xy) - 0.5;
        uvec2 pixel = min(uvec2(max(at, vec2(0.0))), uvec2(resolution - 1));
        return surface_pixel_view(frame, sight, place, face, pixel);
    }
    // Percentage-closer filtering over the four pixels around; at a face's edge the outer ones count for the inner.
    at = clamp(at - 0.5, vec2(0.0), vec2(float(resolution) - 1.0));
    uvec2 low = min(uvec2(at), uvec2(resolution - 2));
    vec2 t = at - vec2(low);
    MapView all = MapView(0.0, 1.0);
    for (uint k = 0; k < 4; ++k) {
        uvec2 step = uvec2(k & 1, k >> 1);
        float weight = (step.x == 0 ? 1.0 - t.x : t.x) * (step.y == 0 ? 1.0 - t.y : t.y);
        if (weight <= 0.0) continue;
        MapView view = surface_pixel_view(frame, sight, place, face, low + step);
        all = MapView(all.seen + weight * view.seen, min(all.told, view.told));
    }
    return all;
}

// For views that tell whether the four pixels around say the same of a point.
SurfaceMapFrame asking_four(SurfaceMapFrame frame)
{
    frame.filter_mode = 2;
    return frame;
}

bool view_is_sure(MapView of_four) { return of_four.seen < 1e-3 || of_four.seen > 1.0 - 1e-3; }
#endif
