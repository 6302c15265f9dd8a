#ifndef LIB_MATERIAL
#define LIB_MATERIAL
// glTF metallic-roughness at a point: textures applied to factors.
//
// Bridge: the kernel defines how a texture is read, its place already found.
#include "lib/scene.glsl"

vec4 sample_texture(TextureSlot slot, vec2 uv);

// A surface point as light transport sees it.
struct Surface {
    vec3 albedo;        // diffuse reflectance
    vec3 f0;            // specular reflectance at normal incidence
    float f90;          // and at grazing incidence
    float alpha;        // GGX roughness, roughness^2; 0 width lobes are clamped
    vec3 emission;      // radiance, W m^-2 sr^-1
    vec3 normal;        // unit shading normal, towards the side looked at
    bool reflects;      // false: back of a one-sided surface, or unlit: blocks light and reflects none
};

vec2 slot_uv(TextureSlot slot, VertexAttributes a)
{
    vec3 uv = vec3(slot.uv_set == 0 ? a.uv0 : a.uv1, 1.0);
    return vec2(dot(slot.row_u, uv), dot(slot.row_v, uv));
}

vec4 slot_value(TextureSlot slot, VertexAttributes a)
{
    return slot.texture == NO_TEXTURE ? vec4(1.0) : sample_texture(slot, slot_uv(slot, a));
}

vec4 base_color_of(Material m, VertexAttributes a)
{
    return m.base_color * a.color * slot_value(m.base_color_texture, a);
}

vec3 emission_of(Material m, VertexAttributes a)
{
    return m.emission * slot_value(m.emission_texture, a).rgb;
}

bool is_hole_of(Material m, VertexAttributes a)
{
    return m.alpha_cutoff >= 0.0 && base_color_of(m, a).a < m.alpha_cutoff;
}

// Diffuse reflectance alone, for element-wise methods.
vec3 albedo_of(Material m, VertexAttributes a)
{
    if ((m.flags & UNLIT) != 0) return vec3(0.0);
    float metallic = m.metallic * slot_value(m.metallic_roughness_texture, a).b;
    return base_color_of(m, a).rgb * (1.0 - metallic);
}

// The whole surface. `normal` and `tangent` are interpolated and unit; `is_back` says that the clockwise side is seen.
Surface surface_of(Material m, VertexAttributes a, vec3 normal, vec4 tangent, bool is_back)
{
    vec4 base = base_color_of(m, a);
    vec4 mr = slot_value(m.metallic_roughness_texture, a);
    float metallic = m.metallic * mr.b;

    Surface s;
    s.albedo = base.rgb * (1.0 - metallic);
    s.f0 = mix(m.dielectric_f0, base.rgb, metallic);
    s.f90 = mix(m.specular, 1.0, metallic);
    if ((m.flags & DIFFUSE_ONLY) != 0) {
        s.f0 = vec3(0.0);
        s.f90 = 0.0;
    }
    float roughness = clamp(m.roughness * mr.g, 0.0, 1.0);
    s.alpha = max(roughness * roughness, 1e-3);
    s.emission = emission_of(m, a);

    if (m.normal_texture.texture != NO_TEXTURE) {
        vec3 t = slot_value(m.normal_texture, a).xyz * 2.0 - 1.0;
        t.xy *= m.normal_scale;
        vec3 bitangent = cross(normal, tangent.xyz) * tangent.w;
        vec3 bent = t.x * tangent.xyz + t.y * bitangent + t.z * normal;
        float squared = dot(bent, bent);
        if (squared > 1e-12) normal = bent * inversesqrt(squared);
    }
    bool double_sided = (m.flags & DOUBLE_SIDED) != 0;
    s.normal = is_back ? -normal : normal;
    s.reflects = (m.flags & UNLIT) == 0 && (double_sided || !is_back);
    if (is_back && !double_sided) s.emission = vec3(0.0);
    return s;
}
#endif
