#ifndef HORIZON
#define HORIZON
// What of a sender may rise above the horizons of a receiver.

// What of a surfel decides: `normal` zero without area.
struct Extents {
    vec3 normal;
    float cos_cone;
    float radius;       // m
    float thickness;    // m
};

// Whether all of the sender at `towards` lies below the horizon of all points and normals of the receiver.
bool is_below_horizon(Extents receiver, Extents sender, vec3 towards)
{
    float sin_cone = sqrt(max(1.0 - receiver.cos_cone * receiver.cos_cone, 0.0));
    float distance_between = length(towards);
    float along = dot(receiver.normal, towards);
    float across = sqrt(max(distance_between * distance_between - along * along, 0.0));
    // Farthest above any plane of the cone that the centre comes.
    float highest = along >= receiver.cos_cone * distance_between ? distance_between : along * receiver.cos_cone + across * sin_cone;
    float own = receiver.radius * sin_cone + receiver.thickness * receiver.cos_cone;
    float cosine = min(abs(dot(receiver.normal, sender.normal)), 1.0), sine = sqrt(1.0 - cosine * cosine);
    bool is_upright = cosine * receiver.cos_cone <= sine * sin_cone || sender.normal == vec3(0.0);
    float tilted = sender.radius * (sine * receiver.cos_cone + cosine * sin_cone) + sender.thickness;
    float reach = is_upright ? sender.radius : min(sender.radius, tilted);
    return receiver.cos_cone > 0.0 && highest + own + reach <= 1e-3 * distance_between;
}
#endif
