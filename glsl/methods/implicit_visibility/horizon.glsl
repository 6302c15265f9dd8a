#ifndef HORIZON
#define HORIZON
// What of a sender may rise above the horizons of a receiver.

// A receiver: all planes through its points and across its normals.
struct Horizon {
    vec3 normal;
    float cos_cone;
    float reach;        // how far its own points lie above its centre, m
};

// What of a sender decides: `normal` zero without area.
struct Extents {
    vec3 normal;
    float radius;       // m
    float thickness;    // m
};

float sine_of(float cosine) { return sqrt(max(1.0 - cosine * cosine, 0.0)); }

float reach_above(float cos_cone, float radius, float thickness) { return radius * sine_of(cos_cone) + thickness * cos_cone; }

// Whether all of the sender at `towards` lies below the horizon of all points and normals of the receiver.
bool is_below_horizon(Horizon receiver, Extents sender, vec3 towards)
{
    float cos_cone = receiver.cos_cone, sin_cone = sine_of(cos_cone);
    float distance_between = length(towards);
    float along = dot(receiver.normal, towards);
    float across = sqrt(max(distance_between * distance_between - along * along, 0.0));
    // Farthest above any plane of the cone that the centre comes.
    float highest = along >= cos_cone * distance_between ? distance_between : along * cos_cone + across * sin_cone;
    float cosine = min(abs(dot(receiver.normal, sender.normal)), 1.0), sine = sqrt(1.0 - cosine * cosine);
    bool is_upright = cosine * cos_cone <= sine * sin_cone || sender.normal == vec3(0.0);
    float tilted = sender.radius * (sine * cos_cone + cosine * sin_cone) + sender.thickness;
    float reach = is_upright ? sender.radius : min(sender.radius, tilted);
    return cos_cone > 0.0 && highest + receiver.reach + reach <= 1e-3 * distance_between;
}
#endif
