#ifndef GLOSS
#define GLOSS
// Glossy leaves as reflectors: their lobes, and where what they reflect goes.
// The kernel binds glossy_leaves, leaf_elements, element_vertices, element_normals, positions, lobes[vertex_count], has
// params.target and params.eye, and is told the number of its bins to set the narrowest lobe.
#include "lib/bins.glsl"
#include "lib/brdf.glsl"
#include "lib/element.glsl"
#include "lib/leaf_gloss.glsl"

// Where a kernel's radiance goes: into the leaves' tables along 6 side^2 bins, or, with side 0, to the eye.
struct GlossTarget {
    uint side;
    uint first;         // of the glossy leaves that are reflected
    uint count;
};

uint direction_count(GlossTarget target) { return target.side == 0 ? 1u : 6 * target.side * target.side; }

// The surface of a leaf as its specular lobe sees it. No lobe is narrower than a bin.
Surface glossy_surface(LeafGloss g, vec3 normal, float bin_count)
{
    Surface s;
    s.albedo = vec3(0.0);
    s.f0 = g.f0;
    s.f90 = g.f90;
    s.alpha = sqrt(g.alpha * g.alpha + 1.0 / bin_count);
    s.emission = vec3(0.0);
    s.normal = normal;
    s.reflects = true;
    return s;
}
#endif
