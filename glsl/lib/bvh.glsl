#ifndef LIB_BVH
#define LIB_BVH
// The bounding volume hierarchy and the one traversal loop. The kernel binds the tables and defines the bridge:
//     BvhNode bvh_node(uint node)                         nodes[node]
//     BvhTriangle bvh_triangle(uint slot)                 triangles in leaf order
//     bool is_hole(uint triangle, vec2 barycentrics)      true where an alpha mask lets the ray pass

#include "lib/ray.glsl"

// Bounds of up to four children, side by side.
struct BvhNode {
    vec4 min_x, max_x, min_y, max_y, min_z, max_z; // metres, world
    uvec4 child;                                   // node index, or leaf, or EMPTY
};

// A leaf is LEAF | (count - 1) << 24 | first slot.
const uint EMPTY = 0xffffffffu;
const uint LEAF = 0x80000000u;

uint leaf_first(uint child) { return child & 0xffffffu; }
uint leaf_count(uint child) { return (child >> 24 & 0x7fu) + 1; }

// The corners as they are in the vertex buffer, so that neighbours share theirs bit by bit.
struct BvhTriangle {
    vec3 corners[3];
    uint triangle; // index in the scene
};

BvhNode bvh_node(uint node);
BvhTriangle bvh_triangle(uint slot);
bool is_hole(uint triangle, vec2 barycentrics);

// A frame in which the ray starts at 0 and runs along +z in units of its direction.
struct RayFrame {
    vec3 origin, x, y, z;
};

RayFrame ray_frame(Ray ray)
{
    // Any two axes will do; orthonormal ones lose least.                       [Duff2017]
    float length_squared = dot(ray.direction, ray.direction);
    vec3 n = ray.direction / sqrt(length_squared);
    float s = n.z >= 0 ? 1.0 : -1.0;
    float a = -1.0 / (s + n.z);
    float b = n.x * n.y * a;
    vec3 x = vec3(1 + s * n.x * n.x * a, s * b, -s * n.x);
    vec3 y = vec3(b, s + n.y * n.y * a, -n.y);
    return RayFrame(ray.origin, x, y, ray.direction / length_squared);
}

// A corner in the ray's frame. `precise`: the same corner must come out the same in every triangle.
vec3 to_ray_frame(RayFrame frame, vec3 corner)
{
    precise vec3 d = corner - frame.origin;
    precise vec3 r = vec3(frame.x.x * d.x + frame.x.y * d.y + frame.x.z * d.z,
                          frame.y.x * d.x + frame.y.y * d.y + frame.y.z * d.z,
                          frame.z.x * d.x + frame.z.y * d.y + frame.z.z * d.z);
    return r;
}

// Watertight: a corner moves to one point in the plane across the ray, whatever the triangle; there the sign of an edge
// function is exact or zero (two rounded products compare like the exact ones), and zero counts as inside, so that the
// ray meets at least one of the triangles around an edge or a corner.                         [Woop2013]
bool intersect_triangle(RayFrame frame, BvhTriangle triangle, float t_min, inout Hit hit)
{
    vec3 a = to_ray_frame(frame, triangle.corners[0]);
    vec3 b = to_ray_frame(frame, triangle.corners[1]);
    vec3 c = to_ray_frame(frame, triangle.corners[2]);
    precise float u = c.x * b.y - c.y * b.x;
    precise float v = a.x * c.y - a.y * c.x;
    precise float w = b.x * a.y - b.y * a.x;
    float least = min(u, min(v, w)), most = max(u, max(v, w));
    if (least < 0 && most > 0) return false;
    float determinant = u + v + w;
    // Seen edge-on, or no area.
    if (determinant == 0) return false;
    float t = (u * a.z + v * b.z + w * c.z) / determinant;
    bool nearer = t < hit.t || (t == hit.t && triangle.triangle < triangle_index(hit));
    if (!(t >= t_min && nearer)) return false;
    vec2 barycentrics = vec2(v, w) / determinant;
    if (is_hole(triangle.triangle, barycentrics)) return false;
    hit = Hit(t, triangle.triangle | (determinant < 0 ? BACK_FACE : 0u), barycentrics);
    return true;
}

// Entries of the stack; the builder keeps trees within it.
const uint BVH_STACK = 64;

// How far boxes are widened per metre of coordinate, so that rounding in the slab test, or of a corner in the ray's
// frame, never loses a triangle: some twenty units in the last place. Boxes carry the share of their own coordinates
// (see bvh/refit_nodes), rays that of their origin.
const float BVH_SLACK = 2e-6;

// The closest hit, or any hit where `any` is true (a constant at each call).
Hit traverse(Ray ray, bool any)
{
    Hit hit = Hit(ray.t_max, NO_HIT, vec2(0));
    if (!is_active(ray)) return hit;
    RayFrame frame = ray_frame(ray);

    // Slabs are entered at plane * inverse + enter and left at plane * inverse + leave.
    vec3 size = abs(ray.direction);
    float longest = max(size.x, max(size.y, size.z));
    // A slope below 1e-9 stays within the slack all along the ray; this one has a finite inverse.
    vec3 flat_slope = mix(vec3(1), vec3(-1), lessThan(ray.direction, vec3(0))) * (longest * 1e-9);
    vec3 inverse = 1 / mix(ray.direction, flat_slope, lessThan(size, abs(flat_slope)));
    vec3 origin = abs(ray.origin);
    vec3 slack = abs(inverse) * (BVH_SLACK * max(origin.x, max(origin.y, origin.z)));
    vec3 enter = -ray.origin * inverse - slack;
    vec3 leave = -ray.origin * inverse + slack;

    uint stack[BVH_STACK];
    uint depth = 0;
    uint entry = 0;
    while (true) {
        if ((entry & LEAF) == 0) {
            // Test the children, nearest to be visited next, the others onto the stack.
            BvhNode node = bvh_node(entry);
            vec4 near = vec4(ray.t_min), far = vec4(hit.t);
            near = max(near, (inverse.x >= 0 ? node.min_x : node.max_x) * inverse.x + enter.x);
            near = max(near, (inverse.y >= 0 ? node.min_y : node.max_y) * inverse.y + enter.y);
            near = max(near, (inverse.z >= 0 ? node.min_z : node.max_z) * inverse.z + enter.z);
            far = min(far, (inverse.x >= 0 ? node.max_x : node.min_x) * inverse.x + leave.x);
            far = min(far, (inverse.y >= 0 ? node.max_y : node.min_y) * inverse.y + leave.y);
            far = min(far, (inverse.z >= 0 ? node.max_z : node.min_z) * inverse.z + leave.z);
            entry = EMPTY;
            float nearest = 0;
            for (uint k = 0; k < 4; ++k) {
                uint child = node.child[k];
                if (child == EMPTY || near[k] > far[k]) continue;
                if (entry == EMPTY) {
                    entry = child;
                    nearest = near[k];
                } else {
                    bool first = near[k] < nearest;
                    stack[depth++] = first ? entry : child;
                    entry = first ? child : entry;
                    nearest = min(nearest, near[k]);
                }
            }
            if (entry != EMPTY) continue;
        } else {
            uint first = leaf_first(entry), count = leaf_count(entry);
            for (uint slot = first; slot < first + count; ++slot)
                if (intersect_triangle(frame, bvh_triangle(slot), ray.t_min, hit) && any) return hit;
        }
        if (depth == 0) return hit;
        entry = stack[--depth];
    }
}
#endif
