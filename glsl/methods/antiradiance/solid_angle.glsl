#ifndef SOLID_ANGLE
#define SOLID_ANGLE
// Of a disc, seen from straight above, of that area over squared distance: never more than half of the sphere.
float disc_solid_angle(float area)
{
    const float PI_OF_DISC = 3.14159265358979;
    float ratio = area / PI_OF_DISC;
    return 2.0 * PI_OF_DISC * (ratio / (sqrt(1.0 + ratio) * (sqrt(1.0 + ratio) + 1.0)));
}

// Of a rectangle (half of its sides, at right angles), from a point `offset` from its middle; 0 in its plane.
float rectangle_solid_angle(vec3 offset, vec3 half_u, vec3 half_v)
{
    float u = length(half_u), v = length(half_v);
    if (!(u * v > 0.0)) return 0.0;
    vec2 at = vec2(dot(offset, half_u) / u, dot(offset, half_v) / v);
    float height = abs(dot(offset, cross(half_u, half_v))) / (u * v);
    vec2 low = vec2(-u, -v) - at, high = vec2(u, v) - at;
    vec4 x = vec4(high.x, low.x, high.x, low.x), y = vec4(high.y, high.y, low.y, low.y);
    vec4 corners = atan(x * y, height * sqrt(x * x + y * y + height * height));
    return abs(corners.x - corners.y - corners.z + corners.w);
}

// Irradiance from a rectangle of radiance 1 (as above, all of it on one side of the receiver's plane), signed by the side of the
// receiver that it arrives at: front positive.
float rectangle_irradiance(vec3 offset, vec3 half_u, vec3 half_v, vec3 normal)
{
    vec3 corners[4] = vec3[](normalize(half_u + half_v - offset), normalize(half_v - half_u - offset),
                             normalize(-half_u - half_v - offset), normalize(half_u - half_v - offset));
    float sum = 0.0;
    for (uint k = 0; k < 4; ++k) {
        vec3 across = cross(corners[k], corners[(k + 1) % 4]);
        float sine = length(across);
        if (sine > 0.0) sum += dot(normal, across) / sine * atan(sine, dot(corners[k], corners[(k + 1) % 4]));
    }
    // Corners run about the rectangle's own normal: the other way round from its other side.
    return dot(cross(half_u, half_v), offset) > 0.0 ? -0.5 * sum : 0.5 * sum;
}
#endif
