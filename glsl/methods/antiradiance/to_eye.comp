#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/direction_bins.glsl"
#include "lib/hierarchy.glsl"
#include "lib/leaf_gloss.glsl"
#include "lib/specular_albedo.glsl"

// One thread per glossy leaf: the irradiance that, reflected evenly as the display does, gives what its specular lobe sends
// to the eye besides its diffuse light.
// reads glossy_leaves[glossy_count], leaves, gloss, cosine_norms, bin_directions, arrived[glossy_count * BIN_COUNT]
// (W m^-2 sr^-1), positions, albedo, members, back_elements[vertex_count], irradiance[element_count] (W/m2)
// updates shown[element_count] (W/m2; of glossy leaves)   shared none
layout(local_size_x = 64) in;
layout(constant_id = 0) const uint WORDS = 2;    // of 64 bits an entry of the tables: 2 (f32) or 1 (f16)
layout(constant_id = 1) const uint BIN_COUNT = 128;
layout(set = 0, binding = 0, scalar) readonly buffer GlossyLeaves { uint glossy_leaves[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Leaves { HierarchyLeaf leaves[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Gloss { LeafGloss gloss[]; };
layout(set = 0, binding = 3, scalar) readonly buffer CosineNorms { float cosine_norms[]; };
layout(set = 0, binding = 4, scalar) readonly buffer BinDirections { uint64_t bin_directions[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Arrived { uint64_t arrived[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Albedo { vec3 albedo[]; };
layout(set = 0, binding = 8, scalar) readonly buffer Irradiance { vec3 irradiance[]; };
layout(set = 0, binding = 9, scalar) writeonly buffer Shown { vec3 shown[]; };
layout(set = 0, binding = 10, scalar) readonly buffer Members { uint members[]; };
layout(set = 0, binding = 11, scalar) readonly buffer BackElements { uint back_elements[]; };
// eye: position and 1, or the direction to an orthographic eye and 0.
layout(push_constant, scalar) uniform Params { vec4 eye; uint glossy_count; } params;

#include "methods/antiradiance/glossy_radiance.glsl"

void main()
{
    uint i = linear_index();
    if (i >= params.glossy_count) return;
    uint leaf = glossy_leaves[i];
    vec3 offset = params.eye.w == 0.0 ? params.eye.xyz : params.eye.xyz - positions[leaves[leaf].element];
    vec3 to_eye = offset / max(length(offset), 1e-20), normal = leaves[leaf].normal;
    bool sees_front = dot(normal, to_eye) > 0.0;
    if (!sees_front && leaves[leaf].back_element == NONE) return;

    // What the display multiplies with: the surface's own lobe, not the widened one.
    Surface s = glossy_surface(gloss[leaf], sees_front ? normal : -normal);
    s.alpha = gloss[leaf].alpha;
    float cos_eye = dot(s.normal, to_eye);
    vec3 glossy = PI * glossy_radiance(i, leaf, to_eye);
    uint first = leaves[leaf].first_member, last = first + leaves[leaf].member_count;
    for (uint member = first; member < last; ++member) {
        uint element = sees_front ? members[member] : back_elements[members[member]];
        s.albedo = albedo[element];
        vec3 sent = diffuse_albedo(s, cos_eye) * irradiance[element] + glossy;
        shown[element] = sent / max(even_albedo(s, cos_eye), vec3(1e-4));
    }
}
