#version 460
#include "lib/prelude.glsl"
#include "lib/specular_albedo.glsl"
#include "methods/implicit_visibility/gloss.glsl"

// One thread per glossy leaf: the irradiance that, reflected evenly as the display does, gives what the leaf's specular
// lobe sends to the eye besides its diffuse light.
// reads glossy_leaves, leaf_elements, element_vertices, element_positions, element_normals, albedo, irradiance
// [element_count] (W/m2), lobes[vertex_count], to_eye[glossy leaf] (W m^-2 sr^-1)
// updates shown[element_count] (W/m2; of glossy leaves)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer GlossyLeaves { uint glossy_leaves[]; };
layout(set = 0, binding = 1, scalar) readonly buffer LeafElements { uint leaf_elements[]; };
layout(set = 0, binding = 2, scalar) readonly buffer ElementVertices { uint element_vertices[]; };
layout(set = 0, binding = 3, scalar) readonly buffer ElementPositions { vec3 element_positions[]; };
layout(set = 0, binding = 4, scalar) readonly buffer ElementNormals { vec3 element_normals[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Albedo { vec3 albedo[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Irradiance { vec3 irradiance[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Lobes { LeafGloss lobes[]; };
layout(set = 0, binding = 8, scalar) readonly buffer ToEye { vec3 to_eye[]; };
layout(set = 0, binding = 9, scalar) writeonly buffer Shown { vec3 shown[]; };
layout(push_constant, scalar) uniform Params { vec4 eye; uint glossy_count; } params;

void main()
{
    uint glossy = linear_index();
    if (glossy >= params.glossy_count) return;
    uint element = leaf_elements[glossy_leaves[glossy]];
    vec3 normal = element_normals[element];
    vec3 direction = normalize(params.eye.xyz - params.eye.w * element_positions[element]);
    // What the display multiplies with: the surface's own lobe, not the widened one.
    Surface s = glossy_surface(lobes[vertex_of(element_vertices[element])], normal, 1e12);
    s.albedo = albedo[element];
    float cos_eye = dot(normal, direction);
    vec3 sent = diffuse_albedo(s, cos_eye) * irradiance[element] + PI * to_eye[glossy];
    shown[element] = sent / max(even_albedo(s, cos_eye), vec3(1e-4));
}
