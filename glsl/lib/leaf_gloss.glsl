#ifndef LIB_LEAF_GLOSS
#define LIB_LEAF_GLOSS
// The specular lobe of a leaf, averaged over its cell.
struct LeafGloss {
    vec3 f0;            // reflectance at normal incidence
    float f90;          // and at grazing incidence
    float alpha;        // GGX roughness
};
#endif
