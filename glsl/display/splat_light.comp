#version 460
#include "lib/prelude.glsl"
#include "lib/element.glsl"
#include "lib/splat.glsl"

// One thread per splat: the light of its vertices, front and back.
// reads splats, shares, back_elements[vertex_count], direct_irradiance and indirect_irradiance [element_count] (W/m2)
// writes splat_light[4 * splat_count] (W/m2: direct, of the front and of the back; indirect)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Splats { Splat splats[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Shares { SplatShare shares[]; };
layout(set = 0, binding = 2, scalar) readonly buffer BackElements { uint back_elements[]; };
layout(set = 0, binding = 3, scalar) readonly buffer DirectIrradiance { vec3 direct_irradiance[]; };
layout(set = 0, binding = 4, scalar) readonly buffer IndirectIrradiance { vec3 indirect_irradiance[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer SplatLight { vec3 splat_light[]; };
layout(push_constant, scalar) uniform Params { uint splat_count; } params;

void main()
{
    uint i = linear_index();
    if (i >= params.splat_count) return;
    vec3 direct[2] = vec3[](vec3(0.0), vec3(0.0)), indirect[2] = vec3[](vec3(0.0), vec3(0.0));
    for (uint k = splats[i].first_share; k < splats[i].first_share + splats[i].share_count; ++k) {
        // One-sided patches show the front's light on either side.
        uint vertex = shares[k].vertex, behind = back_elements[vertex] == NO_ELEMENT ? vertex : back_elements[vertex];
        direct[0] += shares[k].share * direct_irradiance[vertex];
        direct[1] += shares[k].share * direct_irradiance[behind];
        indirect[0] += shares[k].share * indirect_irradiance[vertex];
        indirect[1] += shares[k].share * indirect_irradiance[behind];
    }
    for (uint side = 0; side < 2; ++side) {
        splat_light[4 * i + side] = direct[side];
        splat_light[4 * i + 2 + side] = indirect[side];
    }
}
