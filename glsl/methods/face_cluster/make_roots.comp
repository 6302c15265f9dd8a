#version 460
#include "lib/prelude.glsl"
#include "methods/face_cluster/make_element.glsl"

// One thread per instance: the element of its root.                                            [Gobbetti2003 Alg. 1]
// reads the tables of make_element   writes elements, element_nodes, fits, function_means   updates pool   shared none
layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Params { uint instance_count; float ray_offset; } params;

void main()
{
    uint i = linear_index();
    if (i >= params.instance_count) return;
    make_element(i, i, instances[i].first_cluster, NO_FACE_ELEMENT, 0, params.ray_offset);
}
