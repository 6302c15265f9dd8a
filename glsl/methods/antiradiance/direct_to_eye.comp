#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/prelude.glsl"
#include "lib/brdf.glsl"
#include "lib/emitter.glsl"
#include "lib/hierarchy.glsl"
#include "lib/leaf_gloss.glsl"
#include "lib/specular_albedo.glsl"

// One thread per glossy leaf: the direct irradiance that, reflected evenly as the display does, gives what its specular lobe
// sends to the eye of sampled emitters, and of what came along links and of the environment, besides its diffuse light.
// reads glossy_leaves[glossy_count], leaves, gloss, element_positions (m), samples[sample_count], triangles, positions,
// emission (W m^-2 sr^-1), visible[element_count * ceil(sample_count / 32)] (bits), albedo, members, back_elements[vertex_count],
// irradiance[element_count] (W/m2), cosine_norms, bin_directions, arrived[glossy_count * BIN_COUNT] (W m^-2 sr^-1; if
// has_linked)   updates shown[element_count] (W/m2; of glossy leaves)   shared none
layout(local_size_x = 64) in;
layout(constant_id = 0) const uint WORDS = 2;    // of 64 bits an entry of the tables: 2 (f32) or 1 (f16)
layout(constant_id = 1) const uint BIN_COUNT = 128;
layout(set = 0, binding = 0, scalar) readonly buffer GlossyLeaves { uint glossy_leaves[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Leaves { HierarchyLeaf leaves[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Gloss { LeafGloss gloss[]; };
layout(set = 0, binding = 3, scalar) readonly buffer ElementPositions { vec3 element_positions[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Samples { EmitterSample samples[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Emission { vec3 emission[]; };
layout(set = 0, binding = 8, scalar) readonly buffer Visible { uint visible[]; };
layout(set = 0, binding = 9, scalar) readonly buffer Albedo { vec3 albedo[]; };
layout(set = 0, binding = 10, scalar) readonly buffer Members { uint members[]; };
layout(set = 0, binding = 11, scalar) readonly buffer BackElements { uint back_elements[]; };
layout(set = 0, binding = 12, scalar) readonly buffer Irradiance { vec3 irradiance[]; };
layout(set = 0, binding = 13, scalar) writeonly buffer Shown { vec3 shown[]; };
layout(set = 0, binding = 14, scalar) readonly buffer CosineNorms { float cosine_norms[]; };
layout(set = 0, binding = 15, scalar) readonly buffer BinDirections { uint64_t bin_directions[]; };
layout(set = 0, binding = 16, scalar) readonly buffer Arrived { uint64_t arrived[]; };
// eye: position and 1, or the direction to an orthographic eye and 0; has_linked: 1 where direct light came along links.
layout(push_constant, scalar) uniform Params { vec4 eye; uint glossy_count; uint sample_count; uint has_linked; } params;

#include "methods/antiradiance/glossy_radiance.glsl"
#include "methods/antiradiance/sampled_light.glsl"

void main()
{
    uint i = linear_index();
    if (i >= params.glossy_count) return;
    uint leaf = glossy_leaves[i];
    HierarchyLeaf own = leaves[leaf];
    LeafGloss g = gloss[leaf];
    for (uint member = own.first_member; member < own.first_member + own.member_count; ++member) {
        uint vertex = members[member];
        vec3 offset = params.eye.w == 0.0 ? params.eye.xyz : params.eye.xyz - positions[vertex];
        vec3 to_eye = offset / max(length(offset), 1e-20);
        bool sees_front = dot(own.normal, to_eye) > 0.0;
        uint element = sees_front ? vertex : back_elements[vertex];
        if (element == NONE) continue;

        Surface s = glossy_surface(g, sees_front ? own.normal : -own.normal);
        vec3 sampled, glossy = PI * sampled_radiance(element, s, to_eye, sampled);
        // What the display multiplies with: the surface's own lobe, not the widened one.
        s.alpha = g.alpha;
        s.albedo = albedo[element];
        float cos_eye = dot(s.normal, to_eye);
        vec3 even = even_albedo(s, cos_eye), diffuse = diffuse_albedo(s, cos_eye) * sampled;
        vec3 linked = max(irradiance[element] - sampled, vec3(0.0));
        if (params.has_linked != 0) {
            diffuse += diffuse_albedo(s, cos_eye) * linked;
            glossy += PI * glossy_radiance(i, leaf, to_eye);
            linked = vec3(0.0);
        }
        shown[element] = linked + (diffuse + glossy) / max(even, vec3(1e-4));
    }
}
