#ifndef LIB_SENDER_POINT
#define LIB_SENDER_POINT
// A point of a sender's leaf that a receiver asks for light, and what it reflects of that.
#include "lib/polygon.glsl"
#include "lib/receiver.glsl"

// Leaves nearer than this many of their radii are measured as polygons, farther ones as points: off by 1 % at most.
const float NEAR_RADII = 5.0;

struct SenderPoint {
    vec3 to;            // from the receiver, metres
    bool is_drawn;      // else the leaf's middle
    float lobe_share;   // chance that the specular lobe draws it, else all points of the leaf alike
    bool by_lobe;
};

// How often the receiver's specular lobe draws the point on a leaf: where the lobe is narrower than the leaf, whose points
// would seldom lie in it and then bring too much. The same for all points of a leaf.
float lobe_share(SenderLeaf leaf, Receiver r)
{
    Surface s = r.surface;
    if (!has_specular(s)) return 0.0;
    float cos_eye = abs(dot(s.normal, r.to_eye)), a = s.alpha * s.alpha;
    float peak = 0.5 / (PI * a * (cos_eye + smith_root(cos_eye, s.alpha)));
    float area = leaf_area(leaf);
    vec3 to_centre = leaf.centre - r.position;
    float in_lobe = peak * area / (dot(to_centre, to_centre) + area);
    return specular_share(s, cos_eye) * in_lobe * in_lobe / (1.0 + in_lobe * in_lobe);
}

// `u` draws among the leaf's points and between the two, `lobe` in the receiver's lobe. False where the lobe draws a
// direction that misses the leaf.
bool draw_point(SenderLeaf leaf, Receiver r, vec3 sender_normal, vec3 u, vec2 lobe, bool jitter, out SenderPoint point)
{
    float share = jitter ? lobe_share(leaf, r) : 0.0;
    point = SenderPoint(leaf.centre - r.position, jitter, share, u.z < share);
    if (!point.by_lobe) {
        if (jitter) point.to = leaf_point(leaf, u.xy) - r.position;
        return true;
    }
    vec3 direction = specular_sample(r.surface, folded_eye(r.surface.normal, r.to_eye), lobe);
    float along = dot(sender_normal, direction);
    if (along >= 0.0) return false;
    point.to = dot(sender_normal, point.to) / along * direction;
    return is_on_leaf(leaf, r.position + point.to);
}

// What of the leaf's light the receiver reflects towards the eye, per W/m2 that the leaf sends; `clamped` is the part of it
// that clamping takes. Moves the point where the horizon cuts the leaf.
//
// The diffuse part is exact near by, whichever point was drawn. The specular part of a leaf that fills the lobe, or is
// filled by it, is drawn by both and weighted by the balance heuristic: metal reflects at most twice what its lobe does, and
// all of it is right in the mean.                                                                          [Veach1995]
// Differs from [Ritschel2008]: there senders are points, and near ones are clamped.
vec3 reflected_light(SenderLeaf leaf, Receiver r, vec3 sender_normal, float clamp_radii, inout SenderPoint point, out vec3 clamped)
{
    clamped = vec3(0.0);
    Surface s = r.surface;
    float squared = dot(point.to, point.to), cos_receiver = dot(s.normal, point.to), cos_sender = -dot(sender_normal, point.to);
    bool is_above = cos_receiver > 0.0 && dot(r.geometric, point.to) > 0.0;
    float radius_squared = max(dot(leaf.edge_u, leaf.edge_u), dot(leaf.edge_v, leaf.edge_v));
    float as_point = max(cos_receiver, 0.0) * cos_sender * leaf_area(leaf) / (PI * squared * squared), form_factor = as_point;
    if (!point.by_lobe && squared < NEAR_RADII * NEAR_RADII * radius_squared) {
        vec3 corners[4];
        uint count = leaf_corners(leaf, corners);
        for (uint k = 0; k < 4; ++k) corners[k] -= r.position;
        SeenPolygon seen = seen_polygon(corners, count, s.normal);
        form_factor = seen.form_factor;
        // Of a leaf that the horizon cuts, the part above it sends.
        if (!is_above) {
            point.to = seen.middle;
            squared = dot(point.to, point.to);
            as_point = form_factor;
            if (form_factor <= 0.0 || squared <= 0.0 || dot(r.geometric, point.to) <= 0.0) return vec3(0.0);
        }
    } else if (!is_above) return vec3(0.0);

    vec3 direction = point.to / sqrt(squared);
    LobeValues lobes = brdf_lobes(s, r.to_eye, direction);
    vec3 light = point.by_lobe ? vec3(0.0) : form_factor / (1.0 - point.lobe_share) * lobes.diffuse;
    if (lobes.specular != vec3(0.0)) {
        float by_lobe = specular_density(s, folded_eye(s.normal, r.to_eye), direction);
        float cosine = dot(s.normal, direction);
        // Times pi as the form factor is; without chance one point stands for all, at most with what the lobe reflects.
        float taken = !point.is_drawn ? min(form_factor, cosine / (PI * by_lobe))
            : is_above ? as_point / (1.0 - point.lobe_share + point.lobe_share * by_lobe * PI * as_point / cosine) : 0.0;
        light += taken * lobes.specular;
    }
    if (clamp_radii > 0.0) {
        float clamp_squared = clamp_radii * clamp_radii * radius_squared;
        float kept = min(as_point * squared / max(squared, clamp_squared), form_factor);
        clamped = (1.0 - kept / form_factor) * light;
    }
    return light - clamped;
}
#endif
