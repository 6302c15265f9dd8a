#ifndef TRACE_FREE_WAY_RAY_QUERY
#define TRACE_FREE_WAY_RAY_QUERY
// Whether the way from one point to another is free, by the driver's traversal of `acceleration_structure`, or through
// everything; the bridge of
// the gathers from a sender tree.
layout(constant_id = 1) const bool SEES_THROUGH = false;

float visibility(vec3 origin, vec3 target, uint leaf)
{
    if (SEES_THROUGH) return 1.0;
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
#endif
