#ifndef PLAIN
#define PLAIN
#include "lib/hierarchy.glsl"

// What the front of a plain leaf sends is what it reflects and emits, evenly in all directions, and nothing else: the table need
// not be read to know how it changes. Not while steps are damped, which mix in what was sent before.
// The kernel has params.is_undamped.
bool is_plain(uint flags, uint glossy)
{
    return params.is_undamped != 0 && (flags & (BLOCKS_BEHIND | REFLECTS_BEHIND)) == 0 && glossy == NONE;
}
#endif
