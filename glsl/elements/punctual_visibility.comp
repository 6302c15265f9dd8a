#version 460
#include "lib/prelude.glsl"
#include "lib/ray.glsl"

// One thread per element of a batch: visibility of one light as the mean over the shadow rays that were cast; 0 where all
// points look away.                                                                               [Schmitz2008 3.3]
// reads shadow_offsets[element_count + 1], rays, is_free [rays of the batch] (1 free, 0 blocked)
// writes visibility[light * element_count + element] (0..1)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer ShadowOffsets { uint shadow_offsets[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = 2, scalar) readonly buffer IsFree { uint is_free[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Visibility { float visibility[]; };
layout(push_constant, scalar) uniform Params {
    uint first_element;
    uint batch_count;
    uint element_count;
    uint light;
} params;

void main()
{
    uint i = linear_index();
    if (i >= params.batch_count) return;

    uint element = params.first_element + i;
    uint before = shadow_offsets[params.first_element];
    uint first = shadow_offsets[element] - before, last = shadow_offsets[element + 1] - before;
    uint sent = 0, free = 0;
    for (uint ray = first; ray < last; ++ray) {
        if (rays[ray].t_max < 0.0) continue;
        ++sent;
        free += is_free[ray];
    }
    visibility[params.light * params.element_count + element] = sent > 0 ? float(free) / float(sent) : 0.0;
}
