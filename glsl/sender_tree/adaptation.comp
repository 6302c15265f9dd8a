#version 460
#include "lib/prelude.glsl"
#include "lib/sender_leaf.glsl"

// One workgroup: log-average luminance of what the leaves reflect, weighted by area. Leaves without light, or far darker
// than the mean, are left out: they are the insides of things, at which no picture looks.     [Reinhard2002, Eq. 1]
// reads sender_leaves   writes adaptation[1] (W m^-2 sr^-1; 0 where nothing is lit)   shared two sums
layout(local_size_x = 256) in;
layout(set = 0, binding = 0) uniform usamplerBuffer sender_leaves;     // SENDER_LEAF_TEXELS each
layout(set = 0, binding = 1, scalar) writeonly buffer Adaptation { float adaptation[]; };
layout(push_constant, scalar) uniform Params { uint leaf_count; } params;

const float DARKEST = 1e-3;     // of the mean
shared vec2 sums[256];

// Over the workgroup.
vec2 total(vec2 sum)
{
    uint thread = gl_LocalInvocationID.x;
    barrier();
    sums[thread] = sum;
    barrier();
    for (uint half_count = 128; half_count > 0; half_count /= 2) {
        if (thread < half_count) sums[thread] += sums[thread + half_count];
        barrier();
    }
    return sums[0];
}

uvec4 sender_leaf_texel(uint i) { return texelFetch(sender_leaves, int(i)); }

float leaf_luminance(uint leaf) { return dot(sender_leaf_light(leaf).reflected, vec3(0.2126, 0.7152, 0.0722)) / PI; }

void main()
{
    vec2 sum = vec2(0.0);
    for (uint leaf = gl_LocalInvocationID.x; leaf < params.leaf_count; leaf += 256)
        sum += leaf_area(sender_shape(leaf)) * vec2(leaf_luminance(leaf), 1.0);
    vec2 all = total(sum);
    float darkest = max(DARKEST * all.x / max(all.y, 1e-30), 1e-20);
    sum = vec2(0.0);
    for (uint leaf = gl_LocalInvocationID.x; leaf < params.leaf_count; leaf += 256) {
        float luminance = leaf_luminance(leaf);
        if (luminance > darkest) sum += leaf_area(sender_shape(leaf)) * vec2(log(luminance), 1.0);
    }
    vec2 lit = total(sum);
    if (gl_LocalInvocationID.x == 0) adaptation[0] = lit.y > 0.0 ? exp(lit.x / lit.y) : 0.0;
}
