#ifndef HIDDEN
#define HIDDEN
// What hides a way: the triangles below the winners of bins, whose pixels say which surface is there.   [Dong2007 3]
//
// The kernel binds walk_texels, walk_starts[node_count], leaf_cells, corner_texels, and has params.all_leaves.

const float RIM = 1e-5;     // barycentric coordinates are off by so much: nothing passes between triangles

// Whether a triangle around the leaf's vertex crosses the way.
bool is_leaf_met(uint leaf, vec3 origin, vec3 way)
{
    LeafCell cell = leaf_cells[leaf];
    vec3 to_vertex = cell.vertex - origin;
    bool is_met = false;
    for (uint k = cell.first_corner; k < cell.first_corner + cell.corner_count; ++k) {
        vec3 along_p = uintBitsToFloat(texelFetch(corner_texels, int(CORNER_TEXELS * k)).xyz);
        vec3 along_q = uintBitsToFloat(texelFetch(corner_texels, int(CORNER_TEXELS * k + 1)).xyz);
        vec3 across = cross(along_p, along_q);
        float t = dot(across, to_vertex) / dot(across, way);
        vec3 from_vertex = t * way - to_vertex;
        float p = dot(along_p, from_vertex), q = dot(along_q, from_vertex);
        is_met = is_met || (t > 0.0 && t < 1.0 && min(p, q) >= -RIM && p + q <= 1.0 + RIM);
    }
    return is_met;
}

// Whether anything below a step of the walk does.
bool is_met(uint start, vec3 origin, vec3 way)
{
    uint step_there = start, end = texelFetch(walk_texels, int(WALK_TEXELS * start + 2)).y;
    float squared = dot(way, way);
    bool is_hit = false;
    do {
        vec4 centre = uintBitsToFloat(texelFetch(walk_texels, int(WALK_TEXELS * step_there)));
        vec3 normal = uintBitsToFloat(texelFetch(walk_texels, int(WALK_TEXELS * step_there + 1)).xyz);
        uvec4 rest = texelFetch(walk_texels, int(WALK_TEXELS * step_there + 2));
        vec3 offset = centre.xyz - origin, beside = offset - clamp(dot(offset, way) / squared, 0.0, 1.0) * way;
        // It lies within a sphere and between two planes.
        float above = -dot(normal, offset), above_at_end = above + dot(normal, way), thickness = uintBitsToFloat(rest.z);
        bool is_near = dot(beside, beside) <= centre.w * centre.w && min(above, above_at_end) <= thickness
                       && max(above, above_at_end) >= -thickness;
        bool is_leaf = rest.x < params.all_leaves;
        if (is_near && is_leaf) is_hit = is_leaf_met(rest.x, origin, way);
        step_there = is_near && !is_leaf ? step_there + 1 : rest.y;
    } while (step_there < end && !is_hit);
    return is_hit;
}

// One of the four bins around a direction, across the cube's edges too.
uint bin_beside(vec3 direction, uint corner, uint n)
{
    uint face = face_of(direction);
    vec3 in_axes = in_face(face, direction);
    vec2 low = floor((0.5 * in_axes.xy / in_axes.z + 0.5) * float(n) - 0.5);
    vec2 uv = (2.0 * (low + vec2(corner & 1, corner >> 1)) + 1.0) / float(n) - 1.0;
    return bin_of(face_direction(face, uv), n);
}
#endif
