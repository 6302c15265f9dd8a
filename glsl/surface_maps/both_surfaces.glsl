#ifndef SURFACE_MAPS_BOTH_SURFACES
#define SURFACE_MAPS_BOTH_SURFACES
// The first two surfaces along a ray.
#include "lib/bvh.glsl"

// The nearest hit, and the nearest of those at least `gap` (and a rounding error) behind it, on lit sides alone or on all.
// Whatever the order in which the tree holds them: where what was passed over may count, it is looked for again.
void traverse_both(Ray ray, bool lit, float gap, out Hit first, out Hit second)
{
    first = Hit(ray.t_max, NO_HIT, vec2(0));
    PassedOver passed_over;
    do {
        passed_over = PassedOver(false, false);
        second = walk(ray, false, true, lit, gap, first, passed_over);
        ray.t_min = next_surface(first.t, gap);
    } while (passed_over.may_count);
}
#endif
