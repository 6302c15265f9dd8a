#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/brdf.glsl"
#include "lib/direction_bins.glsl"
#include "lib/emitter.glsl"
#include "lib/hierarchy.glsl"
#include "lib/leaf_gloss.glsl"
#include "lib/light.glsl"

// One thread per (glossy leaf, bin): radiance that its specular lobe sends along the bin of the light of punctual lights and
// sampled emitters, which comes along no link; the mean over its members by area.                                    [Dachsbacher2007 3.3, 4.2 local pass, Eq. 18]
// reads glossy_leaves[glossy_count], leaves, members, back_elements[vertex_count], area[element_count] (m2), gloss, bin_directions, element_positions[element_count] (m), lights[light_count],
// visibility[light_count * element_count], samples[sample_count], triangles, positions, emission[element_count] (W m^-2 sr^-1),
// visible[element_count * ceil(sample_count / 32)] (bits)   updates base[glossy_count * BIN_COUNT] (W m^-2 sr^-1)   shared none
layout(local_size_x = 64) in;
layout(constant_id = 1) const uint BIN_COUNT = 128;
layout(set = 0, binding = 0, scalar) readonly buffer GlossyLeaves { uint glossy_leaves[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Leaves { HierarchyLeaf leaves[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Gloss { LeafGloss gloss[]; };
layout(set = 0, binding = 3, scalar) readonly buffer BinDirections { uint64_t bin_directions[]; };
layout(set = 0, binding = 4, scalar) readonly buffer ElementPositions { vec3 element_positions[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Lights { Light lights[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Visibility { float visibility[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Samples { EmitterSample samples[]; };
layout(set = 0, binding = 8, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 9, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 10, scalar) readonly buffer Emission { vec3 emission[]; };
layout(set = 0, binding = 11, scalar) readonly buffer Visible { uint visible[]; };
layout(set = 0, binding = 12, scalar) buffer Base { vec3 base[]; };
layout(set = 0, binding = 13, scalar) readonly buffer Members { uint members[]; };
layout(set = 0, binding = 14, scalar) readonly buffer BackElements { uint back_elements[]; };
layout(set = 0, binding = 15, scalar) readonly buffer Area { float area[]; };
layout(push_constant, scalar) uniform Params {
    uint glossy_count;
    uint element_count;
    uint light_count;
    uint sample_count;
} params;

#include "methods/antiradiance/glossy_surface.glsl"
#include "methods/antiradiance/sampled_light.glsl"

vec3 sent(uint element, Surface s, vec3 w)
{
    vec3 position = element_positions[element], sum = vec3(0.0);
    for (uint light = 0; light < params.light_count; ++light) {
        vec3 to_light;
        float distance_to_light;
        vec3 arriving = light_irradiance(lights[light], position, to_light, distance_to_light);
        sum += visibility[light * params.element_count + element] * arriving * lobe(s, w, to_light);
    }
    vec3 even;
    return sum + sampled_radiance(element, s, w, even);
}

void main()
{
    uint i = linear_index();
    if (i >= params.glossy_count * BIN_COUNT) return;
    uint leaf = glossy_leaves[i / BIN_COUNT];
    HierarchyLeaf own = leaves[leaf];
    vec3 w = BIN_DIRECTION(i % BIN_COUNT);
    bool leaves_front = dot(own.normal, w) > 0.0;
    if (!leaves_front && own.back_element == NONE) return;
    Surface s = glossy_surface(gloss[leaf], leaves_front ? own.normal : -own.normal);
    vec3 sum = vec3(0.0);
    float area_sum = 0.0;
    for (uint member = own.first_member; member < own.first_member + own.member_count; ++member) {
        uint vertex = members[member];
        sum += area[vertex] * sent(leaves_front ? vertex : back_elements[vertex], s, w);
        area_sum += area[vertex];
    }
    base[i] += area_sum > 0.0 ? sum / area_sum : vec3(0.0);
}
