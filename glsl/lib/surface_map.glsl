#ifndef LIB_SURFACE_MAP
#define LIB_SURFACE_MAP
// Whether a texel of the atlas sees a point, by its compressed depth cube map.                  [Ritschel2008 3.2]
//
// Bridges: the kernel binds the runs of all pixels.
//     uint surface_run_offset(uint index)        where the runs of a pixel's block start; the next one's ends them
//     uint surface_run(uint index)               words: depths, two each, then where runs start in their blocks
#include "lib/cube_map.glsl"
#include "lib/random.glsl"

uint surface_run_offset(uint index);
uint surface_run(uint index);

struct SurfaceMapFrame {
    uint resolution;        // pixels a side of a face
    float codes_per_metre;
    uint filter_mode;       // 0: the pixel itself, 1: one of four around, drawn by its share, 2: all four
    uint sender_filter;     // of the sender's texel and those beside it: 0, 1, 2 likewise
    uint block_bits;        // places of a block are 2 to this, 8 or 16
    uint block_count;
    uint firsts_at;         // words before those that tell where runs start
};

// The depth at a place of the sequence: of the last run of its block that starts at it or before.
uint surface_map_depth(SurfaceMapFrame frame, uint place, uint pixel)
{
    uint bits = frame.block_bits, mask = (1u << bits) - 1, shift = bits == 8 ? 2 : 1;
    uint block = pixel * frame.block_count + (place >> bits), within = place & mask;
    uint low = surface_run_offset(block), high = surface_run_offset(block + 1);
    // low's run starts at or before the place, high's after it.
    while (high - low > 1) {
        uint middle = low + high >> 1;
        uint word = surface_run(frame.firsts_at + (middle >> shift));
        uint first = word >> bits * (middle & (1u << shift) - 1) & mask;
        if (first <= within) low = middle;
        else high = middle;
    }
    return surface_run(low >> 1) >> 16 * (low & 1) & 0xffffu;
}

// Widths of a pixel by which the point's plane may lie off the point's own distance.
const float FARTHEST_PLANE = 16.0;

// What is asked: a point with the unit normal of its surface, from where the map stands.
struct SurfaceMapSight {
    vec3 normal;
    float height;       // of the point's plane over the map, metres
    float distance_to;  // metres
};

// Whether the map at `place` sees the point's surface through a pixel. Depths are of the pixel's own ray: where that meets
// the surface's plane is compared with what it met first, so that no slope needs a bias. A plane that the ray meets far
// from the point, or never, tells nothing of the surface there: then the point's own distance counts.
// Differs from [Ritschel2008]: they compare the point's distance, with a bias.
float surface_pixel_seen(SurfaceMapFrame frame, SurfaceMapSight sight, uint place, uint pixel)
{
    float lean = dot(sight.normal, cube_pixel_direction(pixel, frame.resolution));
    float along = sight.height / (lean == 0.0 ? 1e-30 : lean);
    float width = FARTHEST_PLANE / float(frame.resolution) * sight.distance_to;
    if (!(abs(along - sight.distance_to) <= width)) along = sight.distance_to;
    float code = min(along * frame.codes_per_metre, 65533.0);
    return code <= float(surface_map_depth(frame, place, pixel)) ? 1.0 : 0.0;
}

// Share of the point that is seen from the texel at `place`, whose map stands at `from`; 0 or 1 unfiltered.
float surface_map_visibility(SurfaceMapFrame frame, uint place, vec3 from, vec3 point, vec3 normal)
{
    vec3 d = point - from;
    SurfaceMapSight sight = SurfaceMapSight(normal, dot(normal, d), sqrt(dot(d, d)));
    uint face = cube_face(d);
    uint resolution = frame.resolution;
    vec2 at = cube_place(d, face, resolution);
    if (frame.filter_mode < 2) {
        // A place drawn from a pixel's width around falls into each of the four as often as they share in it.
        if (frame.filter_mode == 1)
            at += unit_interval(pcg4d(uvec4(floatBitsToUint(point), place)).xy) - 0.5;
        uvec2 pixel = min(uvec2(max(at, vec2(0.0))), uvec2(resolution - 1));
        return surface_pixel_seen(frame, sight, place, cube_pixel_index(face, pixel, resolution));
    }
    // Percentage-closer filtering over the four pixels around; at a face's edge the outer ones count for the inner.
    at = clamp(at - 0.5, vec2(0.0), vec2(float(resolution) - 1.0));
    uvec2 low = min(uvec2(at), uvec2(resolution - 2));
    vec2 t = at - vec2(low);
    float sum = 0.0;
    for (uint k = 0; k < 4; ++k) {
        uvec2 step = uvec2(k & 1, k >> 1);
        float weight = (step.x == 0 ? 1.0 - t.x : t.x) * (step.y == 0 ? 1.0 - t.y : t.y);
        if (weight > 0.0)
            sum += weight * surface_pixel_seen(frame, sight, place, cube_pixel_index(face, low + step, resolution));
    }
    return sum;
}
#endif
