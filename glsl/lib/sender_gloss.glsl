#ifndef LIB_SENDER_GLOSS
#define LIB_SENDER_GLOSS
// What shiny leaves of the sender tree send by their lobes: radiance along bins over each leaf's own hemisphere. The tables
// lie behind the leaves: a first texel with their radiosity, then four bins a texel.
// Differs from [Ritschel2008]: there all that senders reflect leaves them evenly; lobes are named as future work.
#include "lib/hemisphere_bins.glsl"
#include "lib/sender_leaf.glsl"
#include "lib/shared_exponent.glsl"

// Texels of a table.
uint gloss_texels(uint side) { return 1 + (side * side + 3) / 4; }

// Where the table of a row starts; rows count from 1.
uint gloss_first(SenderFrame frame, uint row) { return frame.gloss_first + (row - 1) * gloss_texels(frame.gloss_side); }

// Row of a leaf's table; 0: it sends evenly.
uint sender_gloss_row(uint slot) { return sender_leaf_texel(SENDER_LEAF_TEXELS * slot).w >> 1; }

// Radiosity that the whole lobe sends, W/m2.
vec3 sender_gloss_radiosity(SenderFrame frame, uint row) { return uintBitsToFloat(sender_leaf_texel(gloss_first(frame, row)).xyz); }

// Radiance along a direction in the leaf's own axes, between the four bins around, W m^-2 sr^-1.
vec3 sender_gloss_radiance(SenderFrame frame, uint row, vec3 w)
{
    uint side = frame.gloss_side, first = gloss_first(frame, row) + 1;
    vec2 at = clamp(place_in_bins(w, side) - 0.5, vec2(0.0), vec2(float(side) - 1.0));
    uvec2 low = uvec2(at);
    vec2 t = at - vec2(low);
    vec3 sum = vec3(0.0);
    for (uint k = 0; k < 4; ++k) {
        uvec2 step = uvec2(k & 1, k >> 1), cell = min(low + step, uvec2(side - 1));
        float weight = (step.x == 0 ? 1.0 - t.x : t.x) * (step.y == 0 ? 1.0 - t.y : t.y);
        uint bin = cell.y * side + cell.x;
        uvec4 texel = sender_leaf_texel(first + (bin >> 2));
        uint word = (bin & 2) == 0 ? ((bin & 1) == 0 ? texel.x : texel.y) : ((bin & 1) == 0 ? texel.z : texel.w);
        sum += weight * decode_32(word);
    }
    return sum;
}
#endif
