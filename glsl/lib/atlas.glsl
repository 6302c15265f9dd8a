#ifndef LIB_ATLAS
#define LIB_ATLAS
// Texels of the atlas as receivers.
struct AtlasTexel {
    vec3 position;      // centroid, metres
    vec3 normal;        // unit
    vec3 side_u;        // of the parallelogram that stands for it, metres
    vec3 side_v;
    uint first_part;
    uint part_count;
    uint is_back;
};

// "No texel" at a place of the atlas.
const uint NO_TEXEL = 0xffffffffu;

// How a texel shines, means over its parts.
struct TexelGloss {
    vec3 f0;            // specular reflectance at normal incidence
    float f90;          // and at grazing incidence
    float alpha;        // GGX roughness
};

// Whether the eye is on the texel's side. `eye`: its position and 1, or the direction to an orthographic one and 0.
bool shows_towards(AtlasTexel texel, vec4 eye)
{
    return dot(texel.normal, eye.xyz - eye.w * texel.position) > 0.0;
}

// The part of one triangle in a texel.
struct AtlasPart {
    uint triangle;
    vec2 barycentrics;  // of its centroid: corners 1 and 2
    float area;         // m2
};

// A part as a triangle of about its area.
struct PartShape {
    vec3 centre;        // metres
    float until;        // share of the texel's area that this part and those before it have, 0..1
    vec3 edge_u;
    vec3 edge_v;
};

// The point `u` (0..1 twice) of a part, areas in proportion.
vec3 part_point(PartShape part, vec2 u)
{
    if (u.x + u.y > 1.0) u = 1.0 - u;
    return part.centre + (u.x - 1.0 / 3.0) * part.edge_u + (u.y - 1.0 / 3.0) * part.edge_v;
}

// Where a triangle's corners lie in the atlas, texels.
struct TriangleCorners {
    vec2 a;
    vec2 b;
    vec2 c;
};

// The k-th of an even sequence of points on the texel.                                                 [Roberts2018]
vec3 texel_point(AtlasTexel texel, uint k)
{
    vec2 u = fract(vec2(0.5) + float(k) * vec2(0.75487766, 0.56984029)) - 0.5;
    return texel.position + u.x * texel.side_u + u.y * texel.side_v;
}
#endif
