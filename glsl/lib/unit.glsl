#ifndef LIB_UNIT
#define LIB_UNIT
// Exact division and square root: results must not depend on the machine.
vec3 unit_or(vec3 v, vec3 otherwise)
{
    float squared = dot(v, v);
    return squared > 0.0 ? v / sqrt(squared) : otherwise;
}
#endif
