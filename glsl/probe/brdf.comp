#version 460
#include "lib/prelude.glsl"
#include "lib/brdf.glsl"
#include "lib/specular_albedo.glsl"

// One thread per case: the material model by itself, for tests.
// reads cases[case_count]   writes results[case_count]   shared none
struct BrdfCase {
    vec3 albedo;
    vec3 f0;
    float f90;
    float alpha;
    vec3 normal;        // unit
    vec3 to_eye;        // unit
    vec3 to_light;      // unit
    float lobe;         // 0..1
    vec2 place;         // 0..1
};
struct BrdfResult {
    vec3 value;         // of the two directions, sr^-1
    float density;      // of drawing to_light, sr^-1
    vec3 drawn;         // by lobe and place
    vec3 specular;      // reflected to the eye of even light, 1
    vec3 diffuse;
};
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Cases { BrdfCase cases[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Results { BrdfResult results[]; };
layout(push_constant, scalar) uniform Params { uint case_count; } params;

void main()
{
    uint i = linear_index();
    if (i >= params.case_count) return;

    BrdfCase c = cases[i];
    Surface s;
    s.albedo = c.albedo;
    s.f0 = c.f0;
    s.f90 = c.f90;
    s.alpha = c.alpha;
    s.emission = vec3(0.0);
    s.normal = c.normal;
    s.reflects = true;
    results[i].value = brdf_value(s, c.to_eye, c.to_light);
    results[i].density = brdf_density(s, c.to_eye, c.to_light);
    results[i].drawn = brdf_sample(s, c.to_eye, c.lobe, c.place);
    results[i].specular = specular_albedo(s, dot(s.normal, c.to_eye));
    results[i].diffuse = diffuse_albedo(s, dot(s.normal, c.to_eye));
}
