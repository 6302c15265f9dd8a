#version 460
#include "lib/prelude.glsl"
#include "lib/emitter.glsl"
#include "lib/light.glsl"
#include "lib/sky_spot.glsl"
#include "methods/implicit_visibility/gloss.glsl"

// One thread per (glossy leaf, direction): radiance that its specular lobe sends there, of points on emitters, of
// punctual lights and of bright spots of the environment.                                           [Dong2007 4.4]
// reads glossy_leaves, leaf_elements, element_vertices, element_positions, element_normals [element_count], lobes[vertex_count],
// samples[sample_count], triangles, positions, emission, visible (bits), lights, visibility[light_count * element_count],
// spots[spot_count], spots_seen (bits)
// updates reflected[glossy leaf * directions] (W m^-2 sr^-1)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer GlossyLeaves { uint glossy_leaves[]; };
layout(set = 0, binding = 1, scalar) readonly buffer LeafElements { uint leaf_elements[]; };
layout(set = 0, binding = 2, scalar) readonly buffer ElementVertices { uint element_vertices[]; };
layout(set = 0, binding = 3, scalar) readonly buffer ElementPositions { vec3 element_positions[]; };
layout(set = 0, binding = 4, scalar) readonly buffer ElementNormals { vec3 element_normals[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Lobes { LeafGloss lobes[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Samples { EmitterSample samples[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 8, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 9, scalar) readonly buffer Emission { vec3 emission[]; };
layout(set = 0, binding = 10, scalar) readonly buffer Visible { uint visible[]; };
layout(set = 0, binding = 11, scalar) readonly buffer Lights { Light lights[]; };
layout(set = 0, binding = 12, scalar) readonly buffer Visibility { float visibility[]; };    // light-major
layout(set = 0, binding = 13, scalar) buffer Reflected { vec3 reflected[]; };
layout(set = 0, binding = 14, scalar) readonly buffer Spots { SkySpot spots[]; };
layout(set = 0, binding = 15, scalar) readonly buffer SpotsSeen { uint spots_seen[]; };
layout(push_constant, scalar) uniform Params {
    GlossTarget target;
    vec4 eye;               // position and 1, or the direction to an orthographic eye and 0
    uint element_count;
    uint sample_count;
    uint light_count;       // 0: the display adds what it sees of punctual lights itself
    uint spot_count;
    uint bin_count;
} params;

void main()
{
    uint directions = direction_count(params.target), i = linear_index();
    if (i >= params.target.count * directions) return;
    uint glossy = params.target.first + i / directions, element = leaf_elements[glossy_leaves[glossy]];
    vec3 position = element_positions[element], normal = element_normals[element];
    Surface s = glossy_surface(lobes[vertex_of(element_vertices[element])], normal, float(params.bin_count));
    vec3 to_eye = params.target.side != 0 ? bin_direction(i % directions, params.target.side)
                                          : params.eye.xyz - params.eye.w * position;
    to_eye = normalize(to_eye);
    if (dot(to_eye, normal) <= 0.0) return;
    vec3 sum = vec3(0.0);
    uint words = (params.sample_count + 31) / 32;
    for (uint k = 0; k < params.sample_count; ++k) {
        if ((visible[element * words + k / 32] >> k % 32 & 1) == 0) continue;
        EmitterSample at = samples[k];
        uvec3 v = triangles[at.triangle];
        EmitterPoint point = emitter_point(at, positions[v.x], positions[v.y], positions[v.z]);
        vec3 offset = point.position - position;
        float squared = dot(offset, offset);
        if (squared <= 0.0) continue;
        vec3 direction = offset / sqrt(squared);
        float cosines = max(dot(normal, direction), 0.0) * max(emitter_cosine(at, point, -direction), 0.0);
        vec3 radiance = (1.0 - at.barycentrics.x - at.barycentrics.y) * emission[v.x]
                        + at.barycentrics.x * emission[v.y] + at.barycentrics.y * emission[v.z];
        sum += brdf_value(s, to_eye, direction) * radiance * (cosines * point.area / (squared + point.area / PI));
    }
    for (uint light = 0; light < params.light_count; ++light) {
        vec3 to_light;
        float distance_to_light;
        vec3 arriving = light_irradiance(lights[light], position, to_light, distance_to_light);
        float weight = max(dot(normal, to_light), 0.0) * visibility[light * params.element_count + element];
        sum += brdf_value(s, to_eye, to_light) * arriving * weight;
    }
    words = (params.spot_count + 31) / 32;
    for (uint k = 0; k < params.spot_count; ++k) {
        bool is_seen = (spots_seen[element * words + k / 32] >> k % 32 & 1) != 0;
        vec3 direction = spots[k].direction;
        if (is_seen) sum += brdf_value(s, to_eye, direction) * spots[k].irradiance * max(dot(normal, direction), 0.0);
    }
    reflected[glossy * directions + i % directions] += sum;
}
