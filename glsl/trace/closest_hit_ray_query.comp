#version 460
#extension GL_EXT_nonuniform_qualifier : require
#extension GL_EXT_ray_query : require
#include "lib/prelude.glsl"
#include "lib/ray.glsl"
#include "trace/holes.glsl"

// One thread per ray: the closest hit By the driver's traversal; of several hits at one t it may report any.
// reads acceleration_structure, rays[ray_count], the tables of trace/holes   writes hits[ray_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform accelerationStructureEXT acceleration_structure;
layout(set = 0, binding = 2, scalar) readonly buffer Rays        { Ray rays[]; };                  // ray_count
layout(set = 0, binding = 7, scalar) writeonly buffer Hits       { Hit hits[]; };                    // ray_count
layout(push_constant, scalar) uniform Params { uint ray_count; } params;

void main()
{
    uint i = linear_index();
    if (i >= params.ray_count) return;
    uint flags = gl_RayFlagsOpaqueEXT;
    if (ALPHA_TEST) flags = gl_RayFlagsNoneEXT;
    Ray ray = rays[i];
    Hit hit = Hit(ray.t_max, NO_HIT, vec2(0));
    if (is_active(ray)) {
        rayQueryEXT query;
        rayQueryInitializeEXT(query, acceleration_structure, flags, 0xff, ray.origin, ray.t_min, ray.direction, ray.t_max);
        while (rayQueryProceedEXT(query)) {
            // With masks every candidate is asked about, without them none.
            uint triangle = rayQueryGetIntersectionPrimitiveIndexEXT(query, false);
            if (!is_hole(triangle, rayQueryGetIntersectionBarycentricsEXT(query, false)))
                rayQueryConfirmIntersectionEXT(query);
        }
        if (rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionNoneEXT) {
            bool front = rayQueryGetIntersectionFrontFaceEXT(query, true);
            hit = Hit(rayQueryGetIntersectionTEXT(query, true),
                      rayQueryGetIntersectionPrimitiveIndexEXT(query, true) | (front ? 0u : BACK_FACE),
                      rayQueryGetIntersectionBarycentricsEXT(query, true));
        }
    }
    hits[i] = hit;
}
