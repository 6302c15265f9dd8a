#version 460
#extension GL_EXT_nonuniform_qualifier : require
#extension GL_EXT_ray_query : require
#include "lib/prelude.glsl"
#include "lib/ray.glsl"
#include "trace/holes.glsl"

// One thread per pixel: gathers from the sender tree and the environment, seeing by the driver's traversal.
//                                                                                               [Ritschel2008 4.4]
// reads the G-buffer, the sender tree, the acceleration structure and what tells holes, the environment
// updates direct, indirect, gather_counts [pixel_count]   shared none
layout(set = 0, binding = 0) uniform accelerationStructureEXT acceleration_structure;

float visibility(vec3 origin, vec3 target, uint leaf)
{
    uint flags = gl_RayFlagsTerminateOnFirstHitEXT | gl_RayFlagsOpaqueEXT;
    if (ALPHA_TEST) flags = gl_RayFlagsTerminateOnFirstHitEXT;
    vec3 direction = target - origin;
    if (!is_active(Ray(origin, 0.0, direction, 1.0))) return 1.0;
    rayQueryEXT query;
    rayQueryInitializeEXT(query, acceleration_structure, flags, 0xff, origin, 0.0, direction, 1.0);
    while (rayQueryProceedEXT(query)) {
        uint triangle = rayQueryGetIntersectionPrimitiveIndexEXT(query, false);
        if (!is_hole(triangle, rayQueryGetIntersectionBarycentricsEXT(query, false)))
            rayQueryConfirmIntersectionEXT(query);
    }
    return rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionNoneEXT ? 0.0 : 1.0;
}

#include "display/final_gather.glsl"

void main() { gather_pixel(); }
