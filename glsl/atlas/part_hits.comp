#version 460
#include "lib/prelude.glsl"
#include "lib/ray.glsl"
#include "lib/scene.glsl"

// One thread per part of a texel: how many of its rays end at the back of a one-sided surface. From inside of things
// nearly all do; what is there is neither lit nor seen.
// reads hits[batch_count * sample_count], triangle_materials, materials   writes back_hits[part_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Hits { Hit hits[]; };
layout(set = 0, binding = 1, scalar) readonly buffer TriangleMaterials { uint triangle_materials[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Materials { Material materials[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer BackHits { uint back_hits[]; };
layout(push_constant, scalar) uniform Params { uint first_part; uint batch_count; uint sample_count; } params;

void main()
{
    uint i = linear_index();
    if (i >= params.batch_count) return;
    uint count = 0;
    for (uint k = i * params.sample_count; k < (i + 1) * params.sample_count; ++k) {
        if (!is_hit(hits[k]) || !is_back_face(hits[k])) continue;
        if ((materials[triangle_materials[triangle_index(hits[k])]].flags & DOUBLE_SIDED) == 0) ++count;
    }
    back_hits[params.first_part + i] = count;
}
