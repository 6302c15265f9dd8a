#ifndef LIB_SHADOW
#define LIB_SHADOW
// Shadow maps: one layer of reversed depth per view of a light; a point light has six views, +x -x +y -y +z -z.
struct ShadowView {
    mat4 clip_from_world;
    float texel_angle;      // width of a texel at distance 1 (point, spot) ...
    float texel_extent;     // ... or everywhere (directional), metres
};

// The views of a light: `count` layers from `first`; 0 views cast no shadow.
struct ShadowLight {
    uint first;
    uint count;
};

// Which of the six faces of a cube a direction goes through.
uint cube_face(vec3 d)
{
    vec3 a = abs(d);
    if (a.x >= a.y && a.x >= a.z) return d.x >= 0.0 ? 0u : 1u;
    if (a.y >= a.z) return d.y >= 0.0 ? 2u : 3u;
    return d.z >= 0.0 ? 4u : 5u;
}
#endif
