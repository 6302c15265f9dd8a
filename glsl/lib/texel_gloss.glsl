#ifndef LIB_TEXEL_GLOSS
#define LIB_TEXEL_GLOSS
// Where light that arrives at a shiny texel goes in its table: bins over the hemisphere, in the axes of the leaf that it is
// as a sender.
#include "lib/atlas.glsl"
#include "lib/sender_tree.glsl"
#include "lib/hemisphere_bins.glsl"

// Entry of the table of `row` (from 1) that takes what arrives from `to_light`, drawn by `u` among the four around.
uint arrival_entry(AtlasTexel texel, uint row, uint side, vec3 to_light, vec2 u)
{
    SenderLeaf leaf = SenderLeaf(texel.position, texel.side_u, texel.side_v, 0u);
    return (row - 1) * side * side + drawn_bin(on_leaf_axes(leaf, leaf_normal(leaf), to_light), side, u);
}
#endif
