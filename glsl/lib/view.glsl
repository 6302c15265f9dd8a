#ifndef LIB_VIEW
#define LIB_VIEW
// What a pixel sees; the twin of scene::camera::View::ray.
#include "lib/ray.glsl"

struct ViewInfo {
    vec3 position;
    vec3 right;             // unit
    vec3 up;                // unit
    vec3 forward;           // unit
    vec2 half_extent;       // tangents of half the field of view; orthographic: metres
    float near;             // metres along forward
    float far;              // may be infinite
    uint is_orthographic;
};

// The ray through a place of the picture, in pixels from the top left corner, between near and far plane.
Ray view_ray(ViewInfo view, vec2 pixel, uvec2 size)
{
    vec2 at = pixel / vec2(size) * 2.0 - 1.0;
    vec3 across = at.x * view.half_extent.x * view.right - at.y * view.half_extent.y * view.up;
    Ray ray;
    if (view.is_orthographic != 0) {
        ray.origin = view.position + across;
        ray.direction = view.forward;
        ray.t_min = view.near;
        ray.t_max = view.far;
    } else {
        vec3 along = view.forward + across;
        float slant = sqrt(dot(along, along));
        ray.origin = view.position;
        ray.direction = along / slant;
        ray.t_min = view.near * slant;
        ray.t_max = view.far * slant;
    }
    return ray;
}
#endif
