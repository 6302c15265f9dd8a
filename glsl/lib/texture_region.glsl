#ifndef LIB_TEXTURE_REGION
#define LIB_TEXTURE_REGION
// Means of textures over a region of the surface: which level of detail holds them.
#include "lib/scene.glsl"

// Area of the region in each UV set.
vec2 region_uv;

float uv_area(vec2 a, vec2 b, vec2 c)
{
    vec2 ab = b - a, ac = c - a;
    return 0.5 * abs(ab.x * ac.y - ab.y * ac.x);
}

// The region is a share of a triangle from here on.
void set_region(VertexAttributes p, VertexAttributes q, VertexAttributes r, float share)
{
    region_uv = share * vec2(uv_area(p.uv0, q.uv0, r.uv0), uv_area(p.uv1, q.uv1, r.uv1));
}

// The level whose texels are as large as the region, of a texture of `size` texels, with the UVs as the slot turns them.
float region_level(TextureSlot slot, ivec2 size)
{
    float stretch = abs(slot.row_u.x * slot.row_v.y - slot.row_u.y * slot.row_v.x);
    float texels = (slot.uv_set == 0 ? region_uv.x : region_uv.y) * stretch * float(size.x) * float(size.y);
    return 0.5 * log2(max(texels, 1.0));
}
#endif
