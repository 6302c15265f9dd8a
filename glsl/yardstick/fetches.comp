#version 460
#include "lib/prelude.glsl"

// One thread per chain of fetches, each from where the one before says: what look-ups at unrelated places take at least.
// reads table[]   updates places[count] (texels of the table; where the next fetch would be)   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform usamplerBuffer table;
layout(set = 0, binding = 1, scalar) buffer Places { uint places[]; };
layout(push_constant, scalar) uniform Params { uint count; uint fetches; } params;

void main()
{
    uint i = linear_index();
    if (i >= params.count) return;
    uint place = places[i];
    for (uint k = 0; k < params.fetches; ++k) place = texelFetch(table, int(place)).x;
    places[i] = place;
}
