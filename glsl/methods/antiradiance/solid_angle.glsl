#ifndef SOLID_ANGLE
#define SOLID_ANGLE
// Of a disc, seen from straight above, of that area over squared distance: never more than half of the sphere.
float disc_solid_angle(float area)
{
    const float PI_OF_DISC = 3.14159265358979;
    float ratio = area / PI_OF_DISC;
    return 2.0 * PI_OF_DISC * (ratio / (sqrt(1.0 + ratio) * (sqrt(1.0 + ratio) + 1.0)));
}
#endif
