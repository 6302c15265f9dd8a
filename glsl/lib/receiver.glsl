#ifndef LIB_RECEIVER
#define LIB_RECEIVER
// A point that receives light from the sender tree, and the most that it could reflect of a node's.
//                                                                                   [Ritschel2008 4.3; Walter2005 4.1]
#include "lib/brdf.glsl"
#include "lib/sender_tree.glsl"

struct Receiver {
    vec3 position;      // metres
    vec3 geometric;     // unit, of the surface itself, to the side looked at
    vec3 to_eye;        // unit
    Surface surface;
};

// cos(max(a - b, 0)) of two angles in 0..pi.
float cos_of_difference(float cos_a, float cos_b)
{
    if (cos_a >= cos_b) return 1.0;
    return cos_a * cos_b + sqrt(max((1.0 - cos_a * cos_a) * (1.0 - cos_b * cos_b), 0.0));
}

// Upper bound of the specular lobe times the receiver's cosine, over all directions within half angle `spread` of
// `to_light`, sr^-1; that cosine is at most `cos_light`. Turning one of two directions by an angle turns the one halfway by half of it, divided by the cosine
// between them.
float largest_specular(Receiver r, vec3 to_light, float cos_spread, float cos_light)
{
    Surface s = r.surface;
    if (!has_specular(s)) return 0.0;
    vec3 to_eye = folded_eye(s.normal, r.to_eye);
    float spread = acos(clamp(cos_spread, -1.0, 1.0));
    float between = 0.5 * acos(clamp(dot(to_eye, to_light), -1.0, 1.0)) + 0.5 * spread;
    float cos_half = cos(min(between, 0.5 * PI));
    vec3 fresnel = schlick_fresnel(s, cos_half);
    // The Smith term times the cosine grows with the cosine.
    float cos_eye = max(dot(s.normal, to_eye), 1e-6);
    float shadowing = 0.5 * cos_light / (cos_light * smith_root(cos_eye, s.alpha) + cos_eye * smith_root(cos_light, s.alpha));

    vec3 sum = to_eye + to_light;
    float squared = dot(sum, sum);
    float a = s.alpha * s.alpha;
    float peak = 1.0 / (PI * a);
    float largest = max(fresnel.r, max(fresnel.g, fresnel.b)) * shadowing;
    if (squared < 1e-6 || cos_half < 0.05) return largest * peak;
    float turned = 0.5 * spread / cos_half;
    float off = acos(clamp(dot(s.normal, sum) / sqrt(squared), -1.0, 1.0)) - turned;
    if (off <= 0.0) return largest * peak;
    float sine = sin(min(off, 0.5 * PI));
    float d = sine * sine * (1.0 - a) + a;
    return largest * a / (PI * d * d);
}

// Upper bound of the radiance that the receiver reflects of what the node sends unhindered, W m^-2 sr^-1 in the brightest
// channel. 0: none arrives; infinite: the receiver is inside the node.
float largest_radiance(SenderNode node, Receiver r)
{
    vec3 to_node = node.centre - r.position;
    float squared = dot(to_node, to_node);
    float distance_to_node = sqrt(squared);
    float nearest = distance_to_node - node.radius;
    if (node.power <= 0.0) return 0.0;
    if (nearest <= 1e-4 * distance_to_node) return 1e38;

    vec3 to_light = to_node / distance_to_node;
    float sine = node.radius / distance_to_node;
    float cos_spread = sqrt(max(1.0 - sine * sine, 0.0));
    float cos_receiver = cos_of_difference(dot(r.surface.normal, to_light), cos_spread);
    if (cos_receiver <= 0.0 || cos_of_difference(dot(r.geometric, to_light), cos_spread) <= 0.0) return 0.0;
    float cos_axis = cos_of_difference(-dot(node.axis, to_light), node.cos_cone);
    float cos_sender = cos_of_difference(cos_axis, cos_spread);
    if (cos_sender <= 0.0) return 0.0;

    // No direction reflects less than the normal's.
    vec3 albedo = r.surface.albedo, f0 = r.surface.f0;
    float passed = 1.0 - min(max(f0.r, max(f0.g, f0.b)), r.surface.f90);
    float reflected = passed * max(albedo.r, max(albedo.g, albedo.b)) / PI * cos_receiver
                      + largest_specular(r, to_light, cos_spread, cos_receiver);
    return node.power / PI * cos_sender * reflected / (nearest * nearest);
}
#endif
