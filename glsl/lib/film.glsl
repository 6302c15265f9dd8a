#ifndef LIB_FILM
#define LIB_FILM
// What is shown of a film's direct and indirect radiance: report::tonemap's luminance, app::render's LightParts.

const uint LIGHT_ALL = 0u;
const uint LIGHT_DIRECT = 1u;
const uint LIGHT_INDIRECT = 2u;

vec3 shown_light(vec3 direct, vec3 indirect, uint parts)
{
    if (parts == LIGHT_DIRECT) return direct;
    if (parts == LIGHT_INDIRECT) return indirect;
    return direct + indirect;
}

float luminance_of(vec3 rgb) { return dot(rgb, vec3(0.2126, 0.7152, 0.0722)); }

bool is_finite(vec3 rgb) { return !(any(isnan(rgb)) || any(isinf(rgb))); }
#endif
