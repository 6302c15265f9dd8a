#ifndef HIDDEN
#define HIDDEN
// What hides a way: the triangles below the winners of bins, whose pixels say which surface is there.   [Dong2007 3]
//
// The kernel binds walk_texels, walk_starts[node_count], leaf_cells, corner_texels, and has params.all_leaves. Ways start at
// `origin` and are as long as `way`.

const float RIM = 1e-5;     // barycentric coordinates are off by so much: nothing passes between triangles

// Whether a triangle around the leaf's vertex crosses the way.
bool is_leaf_met(uint leaf, vec3 origin, vec3 way)
{
    LeafCell cell = leaf_cells[leaf];
    vec3 to_vertex = cell.vertex - origin;
    bool is_met = false;
    for (uint k = cell.first_corner; k < cell.first_corner + cell.corner_count; ++k) {
        vec3 along_p = uintBitsToFloat(texelFetch(corner_texels, int(CORNER_TEXELS * (k + 1))).xyz);
        vec3 along_q = uintBitsToFloat(texelFetch(corner_texels, int(CORNER_TEXELS * (k + 1) + 1)).xyz);
        vec3 across = cross(along_p, along_q);
        float t = dot(across, to_vertex) / dot(across, way);
        vec3 from_vertex = t * way - to_vertex;
        float p = dot(along_p, from_vertex), q = dot(along_q, from_vertex);
        is_met = is_met || (t > 0.0 && t < 1.0 && min(p, q) >= -RIM && p + q <= 1.0 + RIM);
    }
    return is_met;
}

// What of a step of the walk decides whether it is near a way: it lies within a sphere and between two planes.
struct Bound {
    vec3 offset;        // of the sphere's centre from where ways start, m
    float radius;       // m
    vec3 normal;        // across both planes
    float thickness;    // of half the space between them, m
};

Bound bound_at(uint step_there, vec3 origin, uvec4 rest)
{
    vec4 centre = uintBitsToFloat(texelFetch(walk_texels, int(WALK_TEXELS * step_there)));
    vec3 normal = uintBitsToFloat(texelFetch(walk_texels, int(WALK_TEXELS * step_there + 1)).xyz);
    return Bound(centre.xyz - origin, centre.w, normal, uintBitsToFloat(rest.z));
}

// Whether ways that end in a box of half the size `slack` about the end of `way` may come near it.
bool is_near(Bound b, vec3 way, vec3 slack)
{
    vec3 beside = b.offset - clamp(dot(b.offset, way) / dot(way, way), 0.0, 1.0) * way;
    float above = -dot(b.normal, b.offset), above_at_end = above + dot(b.normal, way), across = dot(abs(b.normal), slack);
    float radius = b.radius + length(slack);
    return dot(beside, beside) <= radius * radius && min(above, above_at_end - across) <= b.thickness
           && max(above, above_at_end + across) >= -b.thickness;
}

// Whether anything below a step of the walk crosses the way.
bool is_met(uint start, vec3 origin, vec3 way)
{
    uint step_there = start, end = texelFetch(walk_texels, int(WALK_TEXELS * start + 2)).y;
    bool is_hit = false;
    do {
        uvec4 rest = texelFetch(walk_texels, int(WALK_TEXELS * step_there + 2));
        bool is_entered = is_near(bound_at(step_there, origin, rest), way, vec3(0.0)), is_leaf = rest.x < params.all_leaves;
        if (is_entered && is_leaf) is_hit = is_leaf_met(rest.x, origin, way);
        step_there = is_entered && !is_leaf ? step_there + 1 : rest.y;
    } while (step_there < end && !is_hit);
    return is_hit;
}

// The cell between the centres of four bins that a direction falls into: its face, and the bin below it along u and v,
// from -1 on.
struct CellBetween {
    uint face;
    vec2 low;
};

CellBetween cell_between(vec3 direction, uint n)
{
    uint face = face_of(direction);
    vec3 in_axes = in_face(face, direction);
    return CellBetween(face, floor((0.5 * in_axes.xy / in_axes.z + 0.5) * float(n) - 0.5));
}

// Tells cells apart.
uint number_of(CellBetween c, uint n)
{
    return (c.face * (n + 1) + as_uint(c.low.y + 1.0)) * (n + 1) + as_uint(c.low.x + 1.0);
}

// One of the four bins around it, across the cube's edges too.
uint bin_around(CellBetween c, uint corner, uint n)
{
    vec2 uv = (2.0 * (c.low + vec2(corner & 1, corner >> 1)) + 1.0) / float(n) - 1.0;
    return bin_of(face_direction(c.face, uv), n);
}

// Where the walk below what a winner names begins: at the node two levels above it. EMPTY_BIN where nothing is named.
uint start_below(uint winner) { return winner == EMPTY_BIN ? EMPTY_BIN : walk_starts[winner & NODE_MASK]; }

// The start, or EMPTY_BIN where no way that ends in the box comes near it.
uint start_near(uint start, vec3 origin, vec3 way, vec3 slack)
{
    if (start == EMPTY_BIN) return EMPTY_BIN;
    uvec4 rest = texelFetch(walk_texels, int(WALK_TEXELS * start + 2));
    return is_near(bound_at(start, origin, rest), way, slack) ? start : EMPTY_BIN;
}

// Whether anything below one of the steps crosses the way.
bool is_any_met(uvec4 starts, vec3 origin, vec3 way)
{
    bool is_hit = false;
    uint k = 0;
    do {
        uint start = starts.x;
        starts = uvec4(starts.yzw, EMPTY_BIN);
        if (start != EMPTY_BIN && all(notEqual(starts, uvec4(start)))) is_hit = is_met(start, origin, way);
    } while (++k < 4 && !is_hit);
    return is_hit;
}
#endif
