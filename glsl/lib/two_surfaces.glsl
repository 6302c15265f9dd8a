#ifndef LIB_TWO_SURFACES
#define LIB_TWO_SURFACES
// The nearest surface along a ray and the next behind it, out of hits in any order.
//
// Bridge: whether a side of a surface reflects light.
//     bool is_lit_side(uint triangle, bool is_back)
#include "lib/ray.glsl"

bool is_lit_side(uint triangle, bool is_back);

// How far behind a hit the next one counts as another surface.
float next_surface(float t, float gap) { return t * 1.000002 + gap; }

// What was passed over as too close behind the first hit so far.
struct PassedOver {
    bool any;
    bool may_count;     // a nearer first hit was found since: what is left out may be another surface after all
};

// Of the two nearest hits so far and one that is nearer than the second, which `hit` is now and `before` was. Where `lit` is
// true, the second is on a side that reflects light.
void keep_both(Hit before, float gap, bool lit, inout Hit first, inout Hit hit, inout PassedOver passed_over)
{
    Hit found = hit;
    bool is_first = found.t < first.t;
    Hit behind = is_first ? first : found;
    float nearest = is_first ? found.t : first.t;
    bool counts = is_hit(behind) && behind.t >= next_surface(nearest, gap);
    passed_over.may_count = passed_over.may_count || (is_first && passed_over.any);
    passed_over.any = passed_over.any || (is_hit(behind) && !counts);
    if (counts && lit) counts = is_lit_side(triangle_index(behind), is_back_face(behind));
    if (is_first) first = found;
    hit = counts ? behind : before;
}
#endif
