#ifndef PATH_TRACING_PATH
#define PATH_TRACING_PATH
// What a path carries from kernel to kernel, and how its two ways of finding light share the work.
#include "lib/material.glsl"

// What lies between the eye and the end of a path.
struct Path {
    vec3 throughput;    // radiance at the eye per radiance arriving at the end, 1
    float density;      // with which the last direction was drawn, sr^-1; 0: it is the camera's ray
};

// Where a path meets a surface.
struct PathVertex {
    vec3 position;
    vec3 geometric_normal;  // unit, towards the side looked at
    float offset;           // metres along it at which rays leave
    vec3 albedo;
    vec3 f0;
    float f90;
    float alpha;
    vec3 normal;            // unit shading normal
    uint reflects;          // 0: the path ends here
};

Surface surface_at(PathVertex v)
{
    Surface s;
    s.albedo = v.albedo;
    s.f0 = v.f0;
    s.f90 = v.f90;
    s.alpha = v.alpha;
    s.emission = vec3(0.0);
    s.normal = v.normal;
    s.reflects = v.reflects != 0;
    return s;
}

// Which of pixel and sample a path belongs to: sample after sample, pixels of the tile side by side.
struct Batch {
    uint path_count;
    uint pixel_count;       // of the tile
    uint first_pixel;
    uint first_sample;
    uint seed;
};

uint pixel_of(Batch batch, uint path) { return batch.first_pixel + path % batch.pixel_count; }
uint sample_of(Batch batch, uint path) { return batch.first_sample + path / batch.pixel_count; }

// Dimensions of random numbers, four in each: one for the camera, and at every vertex one for the light asked (xy the
// place on it, zw which) and one for the reflected ray (xy its direction, z the lobe; w the kind of light asked).
const uint CAMERA_DIMENSION = 0u;
uint light_dimension(uint depth) { return 1u + 2u * depth; }
uint reflection_dimension(uint depth) { return 2u + 2u * depth; }

// How light is found: both ways with weights, by choosing lights alone, or by following reflection alone.
const uint BY_BOTH = 0u;
const uint BY_LIGHTS = 1u;
const uint BY_REFLECTION = 2u;
layout(constant_id = 0) const uint FOUND = BY_BOTH;

// Power heuristic, beta = 2, of two densities of the same direction, the first more than 0.       [Veach1995 Eq. 14]
float power_heuristic(float own, float other)
{
    float ratio = other / own;
    return 1.0 / (1.0 + ratio * ratio);
}

// Weight of light that reflection found and light sampling could have found with density `light`.
float reflection_weight(float reflection, float light)
{
    if (FOUND == BY_LIGHTS) return 0.0;
    return FOUND == BY_REFLECTION ? 1.0 : power_heuristic(reflection, light);
}

// Weight of light that light sampling found and reflection could have found.
float light_weight(float light, float reflection)
{
    return FOUND == BY_LIGHTS ? 1.0 : power_heuristic(light, reflection);
}

// Probabilities of asking one kind of light or another at a vertex.
struct LightChoice {
    float emitters;
    float environment;
    float punctual;
};
#endif
