#ifndef GLOSSY_SURFACE
#define GLOSSY_SURFACE
// The kernel declares BIN_COUNT.
#include "lib/brdf.glsl"
#include "lib/leaf_gloss.glsl"

// The surface of a leaf as its specular lobe sees it, on the side of `normal`. No lobe is narrower than a bin.
Surface glossy_surface(LeafGloss g, vec3 normal)
{
    Surface s;
    s.albedo = vec3(0.0);
    s.f0 = g.f0;
    s.f90 = g.f90;
    s.alpha = sqrt(g.alpha * g.alpha + 1.0 / float(BIN_COUNT));
    s.emission = vec3(0.0);
    s.normal = normal;
    s.reflects = true;
    return s;
}
#endif
