#ifndef TRACE_FREE_RAY_QUERY
#define TRACE_FREE_RAY_QUERY
// Whether the whole length of a ray is free, by the driver's traversal of `acceleration_structure`. Bound beside it: what
// trace/holes asks for.
bool is_free(Ray ray)
{
    if (!is_active(ray)) return true;
    uint flags = gl_RayFlagsTerminateOnFirstHitEXT | gl_RayFlagsOpaqueEXT;
    if (ALPHA_TEST) flags = gl_RayFlagsTerminateOnFirstHitEXT;
    rayQueryEXT query;
    rayQueryInitializeEXT(query, acceleration_structure, flags, 0xff, ray.origin, ray.t_min, ray.direction, ray.t_max);
    while (rayQueryProceedEXT(query)) {
        // With masks every candidate is asked about, without them none.
        uint triangle = rayQueryGetIntersectionPrimitiveIndexEXT(query, false);
        if (!is_hole(triangle, rayQueryGetIntersectionBarycentricsEXT(query, false)))
            rayQueryConfirmIntersectionEXT(query);
    }
    return rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionNoneEXT;
}
#endif
