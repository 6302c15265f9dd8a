#ifndef DISPLAY_DIRECT
#define DISPLAY_DIRECT
// What every display stage starts from, one pixel: background, emission, punctual light, and what is seen there. Shadow
// maps tell where light comes through; where they leave doubt, a ray does.                                [Hertel2009]
// The kernel that includes this says how rays are cast: bool is_free(Ray ray), and binds 0 to 6 and set 1 for that.
#include "display/seen.glsl"
#include "lib/environment.glsl"
#include "lib/light.glsl"
#include "lib/offset.glsl"
#include "lib/shadow.glsl"

bool is_free(Ray ray);

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

// What a shadow map tells of a point.
const uint LIT = 0u, HIDDEN = 1u, IN_DOUBT = 2u;

// Asks the four texels around `point`. Each is compared with the depth of the surface's own plane there (projections keep
// planes plane), so no surface shadows itself. A texel lights the point where the light sees this very surface, and hides
// it where it sees something that stands well before the surface. All else (the light sees past the plane: the surface
// has ended; or sees something close by: a neighbour of a smooth mesh, what touches the surface) tells nothing, nor do
// texels that disagree: a texel may be a hand wide on a surface that the light grazes.
uint told(uint light, vec3 point, vec3 surface_normal, vec3 to_light, float distance_to_light)
{
    ShadowLight views = shadow_lights[light];
    if (views.count == 0) return LIT;
    uint layer = views.first + (views.count == 6 ? cube_face(-to_light) : 0u);
    ShadowView view = shadow_views[layer];
    if ((view.clip_from_world * vec4(point, 1.0)).w <= 0.0) return IN_DOUBT;
    vec3 at = shadow_ndc(view, point);
    if (any(greaterThan(abs(at.xy), vec2(1.0)))) return IN_DOUBT;

    // How depth changes over the plane, from two steps of a texel's width along it.
    float texel = view.texel_extent > 0.0 ? view.texel_extent : view.texel_angle * distance_to_light;
    mat3 basis = basis_of(surface_normal);
    vec3 along_u = shadow_ndc(view, point + texel * basis[0]) - at;
    vec3 along_v = shadow_ndc(view, point + texel * basis[1]) - at;
    float det = along_u.x * along_v.y - along_u.y * along_v.x;
    if (det == 0.0) return IN_DOUBT;
    ivec2 size = textureSize(shadow_maps, 0).xy;
    vec2 slope = vec2(along_u.z * along_v.y - along_v.z * along_u.y, along_v.z * along_u.x - along_u.z * along_v.x)
                 * (2.0 / (det * vec2(size)));
    // One texel's width towards the light, in depth.
    float step_depth = abs(shadow_ndc(view, point + texel * to_light).z - at.z);
    float steepness = abs(slope.x) + abs(slope.y);
    // The last digits of a depth; and what stands before the surface rather than on it.
    float tolerance = 0.01 * step_depth + 0.002 * steepness;
    float clear = 4.0 * step_depth + steepness;

    vec2 place = (at.xy * 0.5 + 0.5) * vec2(size) - 0.5;
    ivec2 first = ivec2(floor(place));
    uint lit = 0, hidden = 0;
    for (int corner = 0; corner < 4; ++corner) {
        ivec2 texel_at = first + ivec2(corner & 1, corner >> 1);
        float plane = at.z + dot(slope, vec2(texel_at) - place);
        float nearest = texelFetch(shadow_maps, ivec3(clamp(texel_at, ivec2(0), size - 1), layer), 0).x;
        lit += abs(plane - nearest) <= tolerance ? 1 : 0;
        hidden += nearest - plane > clear ? 1 : 0;
    }
    return lit == 4 ? LIT : hidden == 4 ? HIDDEN : IN_DOUBT;
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

void shade_pixel()
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
        vec3 origin = seen.position + offset_length(positions[v.x], positions[v.y], positions[v.z]) * seen.geometric;
        for (uint light = 0; light < params.light_count; ++light) {
            vec3 to_light;
            float distance_to_light;
            vec3 arriving = light_irradiance(lights[light], seen.position, to_light, distance_to_light);
            float cosine = dot(s.normal, to_light);
            if (cosine <= 0.0 || dot(seen.geometric, to_light) <= 0.0 || arriving == vec3(0.0)) continue;
            uint answer = told(light, seen.position, seen.geometric, to_light, distance_to_light);
            if (answer == IN_DOUBT) answer = is_free(Ray(origin, 0.0, to_light, distance_to_light)) ? LIT : HIDDEN;
            if (answer == LIT) direct_sum += brdf_value(s, seen.to_eye, to_light) * arriving * cosine;
        }
    }
    float along = dot(seen.position, params.forward) - params.eye_along;
    float distance_to_eye = params.eye.w == 0.0 ? along : distance(seen.position, params.eye.xyz);
    add(index, direct_sum, s.albedo, s.normal, distance_to_eye);
}
#endif
