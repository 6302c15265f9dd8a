#version 460
#include "lib/prelude.glsl"
#include "lib/sender_tree.glsl"

// One workgroup: the mean, by area, of the logarithm of the luminance that lit leaves reflect: what an eye in the room
// would adapt to, whatever it looks at.                                                          [Reinhard2002, Eq. 1]
// reads leaves, leaf_light [leaf_count]   writes adaptation[1] (W m^-2 sr^-1; 0 where nothing is lit)   shared two sums
layout(local_size_x = 256) in;
layout(set = 0, binding = 0, scalar) readonly buffer Leaves { SenderLeaf leaves[]; };
layout(set = 0, binding = 1, scalar) readonly buffer LeafLights { LeafLight leaf_light[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Adaptation { float adaptation[]; };
layout(push_constant, scalar) uniform Params { uint leaf_count; } params;

shared vec2 sums[256];

void main()
{
    uint thread = gl_LocalInvocationID.x;
    vec2 sum = vec2(0.0);
    for (uint leaf = thread; leaf < params.leaf_count; leaf += 256) {
        float luminance = dot(leaf_light[leaf].reflected, vec3(0.2126, 0.7152, 0.0722)) / PI;
        float area = leaf_area(leaves[leaf]);
        if (luminance > 1e-20) sum += area * vec2(log(luminance), 1.0);
    }
    sums[thread] = sum;
    barrier();
    for (uint half_count = 128; half_count > 0; half_count /= 2) {
        if (thread < half_count) sums[thread] += sums[thread + half_count];
        barrier();
    }
    if (thread == 0) adaptation[0] = sums[0].y > 0.0 ? exp(sums[0].x / sums[0].y) : 0.0;
}
