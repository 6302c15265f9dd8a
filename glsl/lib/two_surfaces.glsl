#ifndef LIB_TWO_SURFACES
#define LIB_TWO_SURFACES
// The nearest surface along a ray and the next behind it, out of hits in any order.
#include "lib/ray.glsl"

// How far behind a hit the next one counts as another surface.
float next_surface(float t, float gap) { return t * 1.000002 + gap; }

// Of the two nearest hits so far and one that is nearer than the second, which `hit` is now and `before` was.
void keep_both(Hit before, float gap, inout Hit first, inout Hit hit)
{
    Hit found = hit;
    if (found.t < first.t) {
        hit = is_hit(first) && first.t >= next_surface(found.t, gap) ? first : before;
        first = found;
    } else if (found.t < next_surface(first.t, gap)) {
        hit = before;
    }
}
#endif
