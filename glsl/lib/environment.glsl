#ifndef LIB_ENVIRONMENT
#define LIB_ENVIRONMENT
// Light from infinitely far away; the twin of scene::environment. u = atan2(z, x) / 2 pi + 1/2, v = acos(y) / pi.
//
// Bridge: the kernel reads a texel of the map. Drawing directions by importance is in lib/environment_sampling.glsl.
#include "lib/hemisphere.glsl"
#include "lib/scene.glsl"
vec3 environment_texel(ivec2 texel);


vec2 environment_uv(EnvironmentInfo env, vec3 direction)
{
    float u = fract((atan(direction.z, direction.x) + env.rotation) / (2.0 * PI) + 0.5);
    return vec2(u, acos(clamp(direction.y, -1.0, 1.0)) / PI);
}

vec3 environment_held_texel(EnvironmentInfo env, ivec2 at)
{
    int width = int(env.width);
    return environment_texel(ivec2((at.x + width) % width, clamp(at.y, 0, int(env.height) - 1)));
}

// Radiance along a unit direction, bilinear between texel centres.
vec3 environment_radiance(EnvironmentInfo env, vec3 direction)
{
    if (env.width == 0) return env.constant;
    vec2 at = environment_uv(env, direction) * vec2(env.width, env.height) - 0.5;
    ivec2 low = ivec2(floor(at));
    vec2 t = at - floor(at);
    vec3 upper = mix(environment_held_texel(env, low), environment_held_texel(env, low + ivec2(1, 0)), t.x);
    vec3 lower = mix(environment_held_texel(env, low + ivec2(0, 1)), environment_held_texel(env, low + ivec2(1, 1)), t.x);
    return mix(upper, lower, t.y);
}
#endif
