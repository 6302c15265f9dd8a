#ifndef LIB_BRDF
#define LIB_BRDF
// The one material model: Lambert under GGX with height-correlated Smith masking and Schlick's Fresnel term.
//                                                                                [Walter2007; Heitz2014; glTF 2.0 B.3]
// Directions are unit and point away from the surface. An eye below the plane of the shading normal (interpolated and
// mapped normals allow it) is folded above it: silhouettes would turn black otherwise.
#include "lib/hemisphere.glsl"
#include "lib/material.glsl"

vec3 folded_eye(vec3 normal, vec3 to_eye)
{
    return to_eye - 2.0 * min(dot(normal, to_eye), 0.0) * normal;
}

vec3 schlick_fresnel(Surface s, float cos_half)
{
    float m = clamp(1.0 - cos_half, 0.0, 1.0);
    float m2 = m * m;
    return s.f0 + (vec3(s.f90) - s.f0) * (m2 * m2 * m);
}

// Density of microfacet normals, sr^-1. |n x h|^2 stands for 1 - cos^2, which loses its digits near the peak.
float ggx_distribution(vec3 normal, vec3 halfway, float alpha)
{
    vec3 sine = cross(normal, halfway);
    float cosine = dot(normal, halfway);
    float a = alpha * alpha;
    float d = dot(sine, sine) + a * cosine * cosine;
    return a / (PI * d * d);
}

// sqrt(alpha^2 + (1 - alpha^2) cos^2): Smith's function of one direction is 2 cos / (cos + smith_root).
float smith_root(float cosine, float alpha)
{
    float a = alpha * alpha;
    return sqrt(a + (1.0 - a) * cosine * cosine);
}

bool has_specular(Surface s) { return s.f90 > 0.0 || s.f0 != vec3(0.0); }

// Reflected radiance per arriving irradiance, sr^-1, of either lobe; the cosine towards the light is the caller's.
struct LobeValues {
    vec3 diffuse;
    vec3 specular;
};

LobeValues brdf_lobes(Surface s, vec3 to_eye, vec3 to_light)
{
    float cos_light = dot(s.normal, to_light);
    if (!s.reflects || cos_light <= 0.0) return LobeValues(vec3(0.0), vec3(0.0));
    if (!has_specular(s)) return LobeValues(s.albedo / PI, vec3(0.0));

    to_eye = folded_eye(s.normal, to_eye);
    float cos_eye = max(dot(s.normal, to_eye), 1e-6);
    vec3 sum = to_eye + to_light;
    float squared = dot(sum, sum);
    if (squared < 1e-12) return LobeValues(s.albedo / PI, vec3(0.0));
    vec3 halfway = sum / sqrt(squared);

    vec3 fresnel = schlick_fresnel(s, dot(to_eye, halfway));
    float shadowing = 0.5 / (cos_light * smith_root(cos_eye, s.alpha) + cos_eye * smith_root(cos_light, s.alpha));
    float specular = ggx_distribution(s.normal, halfway, s.alpha) * shadowing;
    // What the upper layer reflects does not reach the lower one.          [KHR_materials_specular, "dielectric_brdf"]
    float passed = 1.0 - max(fresnel.r, max(fresnel.g, fresnel.b));
    return LobeValues(s.albedo * (passed / PI), fresnel * specular);
}

// Of both.
vec3 brdf_value(Surface s, vec3 to_eye, vec3 to_light)
{
    LobeValues lobes = brdf_lobes(s, to_eye, to_light);
    return lobes.diffuse + lobes.specular;
}

// Share of samples that the specular lobe gets: what it reflects of all that is reflected, roughly.
float specular_share(Surface s, float cos_eye)
{
    if (!has_specular(s)) return 0.0;
    vec3 fresnel = schlick_fresnel(s, cos_eye);
    float passed = 1.0 - max(fresnel.r, max(fresnel.g, fresnel.b));
    float diffuse = (s.albedo.r + s.albedo.g + s.albedo.b) * passed;
    float specular = fresnel.r + fresnel.g + fresnel.b;
    if (diffuse <= 0.0) return 1.0;
    return clamp(specular / (specular + diffuse), 0.1, 0.9);
}

// Density with which the specular lobe draws `to_light`, sr^-1: visible normals D G1 (v.h) / (n.v), and
// dh / dl = 1 / (4 v.h). The eye is above the plane.
float specular_density(Surface s, vec3 to_eye, vec3 to_light)
{
    vec3 sum = to_eye + to_light;
    float squared = dot(sum, sum);
    if (squared < 1e-12) return 0.0;
    vec3 halfway = sum / sqrt(squared);
    float cos_eye = dot(s.normal, to_eye);
    float visible = ggx_distribution(s.normal, halfway, s.alpha) * 0.5 / (cos_eye + smith_root(cos_eye, s.alpha));
    return dot(s.normal, halfway) > 0.0 ? visible : 0.0;
}

// Density with which brdf_sample draws `to_light`, sr^-1.
float brdf_density(Surface s, vec3 to_eye, vec3 to_light)
{
    float cos_light = dot(s.normal, to_light);
    to_eye = folded_eye(s.normal, to_eye);
    float share = specular_share(s, dot(s.normal, to_eye));
    float density = (1.0 - share) * max(cos_light, 0.0) / PI;
    return share == 0.0 ? density : density + share * specular_density(s, to_eye, to_light);
}

// A microfacet normal about +z out of those that `eye` sees.                                    [Dupuy2023]
vec3 visible_normal(vec3 eye, float alpha, vec2 u)
{
    vec3 stretched = vec3(alpha * eye.xy, eye.z);
    stretched /= sqrt(dot(stretched, stretched));
    float phi = 2.0 * PI * u.x;
    float z = (1.0 - u.y) * (1.0 + stretched.z) - stretched.z;
    float sine = sqrt(clamp(1.0 - z * z, 0.0, 1.0));
    vec3 cap = vec3(sine * cos(phi), sine * sin(phi), z) + stretched;
    vec3 normal = vec3(alpha * cap.xy, max(cap.z, 1e-7));
    return normal / sqrt(dot(normal, normal));
}

// A direction for light to come from, in proportion to what the specular lobe reflects, nearly. The eye is above the plane.
vec3 specular_sample(Surface s, vec3 to_eye, vec2 u)
{
    mat3 basis = basis_of(s.normal);
    vec3 halfway = basis * visible_normal(to_eye * basis, s.alpha, u);
    return 2.0 * dot(to_eye, halfway) * halfway - to_eye;
}

// ... to what both lobes reflect. It may lie below the plane of the normal, where nothing is reflected.
vec3 brdf_sample(Surface s, vec3 to_eye, float lobe, vec2 u)
{
    to_eye = folded_eye(s.normal, to_eye);
    if (lobe >= specular_share(s, dot(s.normal, to_eye))) return basis_of(s.normal) * cosine_hemisphere(u);
    return specular_sample(s, to_eye, u);
}
#endif
