#version 460
#include "lib/prelude.glsl"
#include "lib/surfel.glsl"

// One thread per node of one level: its surfel from its children's.                               [Dong2007 4.2.1]
// reads node_segments[node_count], segments   updates surfels, moments [node_count]; the level below is done   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer NodeSegments { uint node_segments[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Segments { QuadtreeSegment segments[]; };
layout(set = 0, binding = 2, scalar) buffer Surfels { Surfel surfels[]; };
layout(set = 0, binding = 3, scalar) buffer Moments { SurfelMoments moments[]; };
layout(push_constant, scalar) uniform Params { uint first; uint count; } params;

void main()
{
    uint i = linear_index();
    if (i >= params.count) return;
    uint node = params.first + i;
    uvec2 children = quadtree_children(segments[node_segments[node]], node);

    Surfel s;
    SurfelMoments m = SurfelMoments(vec3(0.0), vec3(0.0), vec3(0.0));
    s.area = 0.0;
    vec3 sum = vec3(0.0), plain_sum = vec3(0.0);
    for (uint k = children.x; k < children.x + children.y; ++k) {
        s.area += surfels[k].area;
        sum += surfels[k].area * surfels[k].centre;
        plain_sum += surfels[k].centre;
        m.across += moments[k].across;
    }
    s.centre = s.area > 0.0 ? sum / s.area : plain_sum / float(children.y);
    float length_across = length(m.across);
    s.normal = length_across > 1e-6 * s.area && s.area > 0.0 ? m.across / length_across : surfels[children.x].normal;

    s.radius = s.thickness = 0.0;
    float widest = 0.0;     // radians
    for (uint k = children.x; k < children.x + children.y; ++k) {
        Surfel child = surfels[k];
        vec3 offset = child.centre - s.centre;
        if (s.area > 0.0) {
            float share = child.area / s.area;
            m.diagonal += share * (moments[k].diagonal + offset * offset);
            m.mixed += share * (moments[k].mixed + offset * offset.yzx);
        }
        float cosine = clamp(dot(s.normal, child.normal), -1.0, 1.0), sine = sqrt(1.0 - cosine * cosine);
        s.radius = max(s.radius, length(offset) + child.radius);
        s.thickness = max(s.thickness, abs(dot(offset, s.normal)) + min(child.radius * sine + child.thickness, child.radius));
        widest = max(widest, acos(cosine) + acos(clamp(child.cos_cone, -1.0, 1.0)));
    }
    s.cos_cone = widest >= PI ? -1.0 : cos(widest);
    shape_surfel(m, s);
    surfels[node] = s;
    moments[node] = m;
}
