#version 460
#include "lib/prelude.glsl"
#include "display/seen.glsl"
#include "lib/environment.glsl"
#include "lib/light.glsl"
#include "lib/shadow.glsl"

// One thread per pixel: what every display stage starts from: background, emission, punctual light by shadow maps, and
// what is seen there. The stage adds all other light.
// reads the G-buffer, triangles, positions, normals, lights, shadow maps, the environment
// updates direct, indirect, albedo, normal, depth [pixel_count]   shared none
layout(set = 0, binding = 8, scalar) readonly buffer Lights { Light lights[]; };
layout(set = 0, binding = 9, scalar) readonly buffer ShadowLights { ShadowLight shadow_lights[]; };
layout(set = 0, binding = 10, scalar) readonly buffer ShadowViews { ShadowView shadow_views[]; };
layout(set = 0, binding = 11) uniform sampler2DArray shadow_maps;
layout(set = 0, binding = 12, scalar) readonly buffer EnvironmentInfos { EnvironmentInfo environment_info[]; };
layout(set = 0, binding = 13) uniform sampler2D environment_map;
layout(set = 0, binding = 14, scalar) buffer Direct { vec3 direct[]; };
layout(set = 0, binding = 15, scalar) buffer Indirect { vec3 indirect[]; };
layout(set = 0, binding = 16, scalar) buffer AlbedoSum { vec3 albedo[]; };
layout(set = 0, binding = 17, scalar) buffer NormalSum { vec3 normal[]; };
layout(set = 0, binding = 18, scalar) buffer DepthSum { float depth[]; };
layout(set = 0, binding = 19, scalar) readonly buffer Normals { vec3 normals[]; };
// eye: position and 1, or the direction to an orthographic eye and 0; weight: of this sample of the pixel.
layout(push_constant, scalar) uniform Params {
    mat4 clip_from_world;
    vec4 eye;
    vec3 forward;
    float eye_along;    // the eye's place along forward, metres
    uint light_count;
    float weight;
    uint is_first;
    uint is_unlit;      // surfaces stay black
} params;

vec3 environment_texel(ivec2 texel) { return texelFetch(environment_map, texel, 0).rgb; }

vec3 shadow_ndc(ShadowView view, vec3 point)
{
    vec4 clip = view.clip_from_world * vec4(point, 1.0);
    return clip.xyz / clip.w;
}

// Share of the light that reaches `point`: 3 texels a side around it, smoothed. Each texel is compared with the depth
// of the surface's own plane there (projections keep planes plane), so no surface shadows itself, and nothing has to
// be moved towards the light, which would leak through walls without thickness. A texel is free where the light sees
// this very surface. Where it sees past the plane, the surface has ended: that counts as blocked where others are, or
// sunlight outside would shine in along the edges of a room. `smooth_normal`: of the mesh, without normal maps, which raise no
// triangle above another.
float lit_share(uint light, vec3 point, vec3 surface_normal, vec3 smooth_normal, vec3 to_light, float distance_to_light)
{
    ShadowLight views = shadow_lights[light];
    if (views.count == 0) return 1.0;
    uint layer = views.first + (views.count == 6 ? cube_face(-to_light) : 0u);
    ShadowView view = shadow_views[layer];
    if ((view.clip_from_world * vec4(point, 1.0)).w <= 0.0) return 1.0;
    vec3 at = shadow_ndc(view, point);
    if (any(greaterThan(abs(at.xy), vec2(1.0)))) return 1.0;

    // How depth changes over the plane, from two steps of a texel's width along it.
    float texel = view.texel_extent > 0.0 ? view.texel_extent : view.texel_angle * distance_to_light;
    mat3 basis = basis_of(surface_normal);
    vec3 along_u = shadow_ndc(view, point + texel * basis[0]) - at;
    vec3 along_v = shadow_ndc(view, point + texel * basis[1]) - at;
    float det = along_u.x * along_v.y - along_u.y * along_v.x;
    vec2 slope = det == 0.0 ? vec2(0.0)
        : vec2(along_u.z * along_v.y - along_v.z * along_u.y, along_v.z * along_u.x - along_u.z * along_v.x) / det;
    ivec2 size = textureSize(shadow_maps, 0).xy;
    vec2 texel_ndc = 2.0 / vec2(size);
    // One texel's width towards the light, in depth: the measure of what counts as nearer.
    float step_depth = abs(shadow_ndc(view, point + texel * to_light).z - at.z);
    // Next to a triangle of a smooth mesh others rise above its plane, by about twice what the normals differ, two
    // texels away; a flat surface needs no more than the last digits of a depth.
    float rise = 8.0 * distance(surface_normal, smooth_normal) / max(dot(surface_normal, to_light), 0.1);
    slope = clamp(slope * texel_ndc, vec2(-30.0 * step_depth), vec2(30.0 * step_depth));
    float tolerance = (0.01 + rise) * step_depth + 0.002 * (abs(slope.x) + abs(slope.y));

    vec2 place = (at.xy * 0.5 + 0.5) * vec2(size) - 0.5;
    ivec2 first = ivec2(floor(place)) - 1;
    vec2 f = place - floor(place);
    float free = 0.0, blocked = 0.0, beyond = 0.0;
    for (int y = 0; y < 4; ++y) {
        float weight_y = y == 0 ? 1.0 - f.y : y == 3 ? f.y : 1.0;
        for (int x = 0; x < 4; ++x) {
            float weight = weight_y * (x == 0 ? 1.0 - f.x : x == 3 ? f.x : 1.0);
            ivec2 texel_at = clamp(first + ivec2(x, y), ivec2(0), size - 1);
            float plane = at.z + dot(slope, vec2(first + ivec2(x, y)) - place);
            float nearest = texelFetch(shadow_maps, ivec3(texel_at, layer), 0).x;
            if (plane - nearest > tolerance) beyond += weight;
            else if (plane + tolerance >= nearest) free += weight;
            else blocked += weight;
        }
    }
    return blocked > 0.0 ? free / (free + blocked + beyond) : 1.0;
}

void add(uint index, vec3 direct_value, vec3 albedo_value, vec3 normal_value, float depth_value)
{
    float w = params.weight;
    bool first = params.is_first != 0;
    direct[index] = (first ? vec3(0.0) : direct[index]) + w * direct_value;
    if (first) indirect[index] = vec3(0.0);
    albedo[index] = (first ? vec3(0.0) : albedo[index]) + w * albedo_value;
    normal[index] = (first ? vec3(0.0) : normal[index]) + w * normal_value;
    depth[index] = (first ? 0.0 : depth[index]) + w * depth_value;
}

void main()
{
    ivec2 pixel;
    uint index;
    if (!is_in_picture(pixel, index)) return;
    Seen seen;
    if (!is_seen(pixel, params.eye, seen)) {
        // The background: along the ray through the pixel.
        vec2 ndc = (vec2(pixel) + 0.5) * 2.0 / vec2(textureSize(visible_triangles, 0)) - 1.0;
        vec4 near = inverse(params.clip_from_world) * vec4(ndc, 1.0, 1.0);
        vec3 direction = params.eye.w == 0.0 ? params.forward : normalize(near.xyz / near.w - params.eye.xyz);
        add(index, environment_radiance(environment_info[0], direction), vec3(0.0), vec3(0.0), 0.0);
        return;
    }

    Surface s = seen.surface;
    vec3 direct_sum = params.is_unlit != 0 ? vec3(0.0) : s.emission;
    if (s.reflects && params.is_unlit == 0) {
        uvec3 v = seen.vertices;
        vec3 smooth_normal = normalize(mat3(normals[v.x], normals[v.y], normals[v.z]) * seen.weights);
        if (seen.is_back) smooth_normal = -smooth_normal;
        for (uint light = 0; light < params.light_count; ++light) {
            vec3 to_light;
            float distance_to_light;
            vec3 arriving = light_irradiance(lights[light], seen.position, to_light, distance_to_light);
            float cosine = dot(s.normal, to_light);
            if (cosine <= 0.0 || dot(seen.geometric, to_light) <= 0.0 || arriving == vec3(0.0)) continue;
            float lit = lit_share(light, seen.position, seen.geometric, smooth_normal, to_light, distance_to_light);
            if (lit > 0.0) direct_sum += brdf_value(s, seen.to_eye, to_light) * arriving * (cosine * lit);
        }
    }
    float along = dot(seen.position, params.forward) - params.eye_along;
    float distance_to_eye = params.eye.w == 0.0 ? along : distance(seen.position, params.eye.xyz);
    add(index, direct_sum, s.albedo, s.normal, distance_to_eye);
}
