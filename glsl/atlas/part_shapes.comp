#version 460
#include "lib/prelude.glsl"
#include "lib/atlas.glsl"

// One thread per texel: where its parts lie, as triangles of about their areas about their centroids, each alike its own
// triangle and within it, so that points drawn on them lie on the surface.
// reads texels, parts, triangles, positions   writes shapes[part_count]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Texels { AtlasTexel texels[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Parts { AtlasPart parts[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer Shapes { PartShape shapes[]; };
layout(push_constant, scalar) uniform Params { uint texel_count; } params;

void main()
{
    uint i = linear_index();
    if (i >= params.texel_count) return;

    uint first = texels[i].first_part, end = first + texels[i].part_count;
    float area_sum = 0.0;
    for (uint k = first; k < end; ++k) area_sum += parts[k].area;
    float until = 0.0;
    for (uint k = first; k < end; ++k) {
        AtlasPart part = parts[k];
        uvec3 v = triangles[part.triangle];
        vec3 a = positions[v.x], ab = positions[v.y] - a, ac = positions[v.z] - a;
        vec3 across = cross(ab, ac);
        float area = 0.5 * sqrt(dot(across, across));
        vec3 w = vec3(1.0 - part.barycentrics.x - part.barycentrics.y, part.barycentrics);
        // Of its area, or as large as fits about its centroid.
        float most = 3.0 * max(min(w.x, min(w.y, w.z)), 0.0);
        float scale = area > 0.0 ? min(sqrt(part.area / area), most) : 0.0;
        until += area_sum > 0.0 ? part.area / area_sum : 0.0;
        shapes[k] = PartShape(a + part.barycentrics.x * ab + part.barycentrics.y * ac, until, scale * ab, scale * ac);
    }
}
