#ifndef LIB_ENVIRONMENT_SAMPLING
#define LIB_ENVIRONMENT_SAMPLING
// Directions drawn in proportion to the environment's luminance; the twin of scene::environment::sampling.
//
// Bridge: the kernel reads a cell of the alias table.
#include "lib/environment.glsl"
EnvironmentCell environment_cell(uint index);

// Density with which environment_sample draws a direction, sr^-1.
float environment_density(EnvironmentInfo env, vec3 direction)
{
    if (env.width == 0) return 1.0 / (4.0 * PI);
    vec2 uv = environment_uv(env, direction);
    uint column = min(uint(uv.x * env.width), env.width - 1) / env.cell_extent;
    uint row = min(uint(uv.y * env.height), env.height - 1) / env.cell_extent;
    return environment_cell(row * env.cell_columns + column).density;
}

// A direction drawn by luminance from four random numbers in 0..1, and its density, sr^-1.
vec3 environment_sample(EnvironmentInfo env, vec2 choose, vec2 inside, out float density)
{
    uint columns = max(env.cell_columns, 1), rows = max(env.cell_rows, 1);
    uint count = columns * rows;
    uint drawn = min(uint(choose.x * count), count - 1);
    EnvironmentCell cell = environment_cell(drawn);
    uint index = choose.y < cell.threshold ? drawn : cell.alias;
    density = environment_cell(index).density;

    float width = max(env.width, 1), height = max(env.height, 1);
    vec2 first = vec2(index % columns, index / columns) * env.cell_extent;
    vec2 last = min(first + env.cell_extent, vec2(width, height));
    float u = mix(first.x, last.x, inside.x) / width;
    float cos_theta = mix(cos(PI * first.y / height), cos(PI * last.y / height), inside.y);
    float sin_theta = sqrt(max(1.0 - cos_theta * cos_theta, 0.0));
    float phi = (u - 0.5) * 2.0 * PI - env.rotation;
    return vec3(sin_theta * cos(phi), cos_theta, sin_theta * sin(phi));
}
#endif
