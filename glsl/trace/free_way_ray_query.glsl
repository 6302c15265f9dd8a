#ifndef TRACE_FREE_WAY_RAY_QUERY
#define TRACE_FREE_WAY_RAY_QUERY
// Whether the way from one point to another is free, by the driver's traversal of `acceleration_structure`, or through
// everything; the bridge of the gathers from a sender tree.
#include "trace/free_ray_query.glsl"

layout(constant_id = 1) const bool SEES_THROUGH = false;

float visibility(vec3 origin, vec3 target, uint leaf)
{
    return SEES_THROUGH || is_free(Ray(origin, 0.0, target - origin, 1.0)) ? 1.0 : 0.0;
}
#endif
