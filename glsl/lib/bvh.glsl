#ifndef LIB_BVH
#define LIB_BVH
// The bounding volume hierarchy: four children a node, bounds in eight bits, and the one traversal loop.
// The kernel binds the two tables and defines the bridge:
//     uvec4 bvh_node_texel(uint i)                        nodes, NODE_TEXELS each
//     uvec4 bvh_triangle_texel(uint i)                    triangles in leaf order, TRIANGLE_TEXELS each
//     bool is_hole(uint triangle, vec2 barycentrics)      true where an alpha mask lets the ray pass
#include "lib/bvh_pack.glsl"
#include "lib/ray.glsl"
#include "lib/two_surfaces.glsl"

uvec4 bvh_node_texel(uint i);
uvec4 bvh_triangle_texel(uint i);
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

// Tests the triangle at `slot` where `wanted`; true for a nearer hit, which replaces `hit`. Without branches: each would
// cost more than it saves where threads run in lockstep.
// Watertight: a corner moves to one point in the plane across the ray, whatever the triangle; there the sign of an edge
// function is exact or zero (two rounded products compare like the exact ones), and zero counts as inside, so that the
// ray meets at least one of the triangles around an edge or a corner.                         [Woop2013]
bool intersect_triangle(RayFrame frame, uint slot, bool wanted, float t_min, inout Hit hit)
{
    uvec4 texel0 = bvh_triangle_texel(TRIANGLE_TEXELS * slot);
    uvec4 texel1 = bvh_triangle_texel(TRIANGLE_TEXELS * slot + 1);
    uvec4 texel2 = bvh_triangle_texel(TRIANGLE_TEXELS * slot + 2);
    uint triangle = texel2.y;
    vec3 a = to_ray_frame(frame, uintBitsToFloat(texel0.xyz));
    vec3 b = to_ray_frame(frame, uintBitsToFloat(uvec3(texel0.w, texel1.xy)));
    vec3 c = to_ray_frame(frame, uintBitsToFloat(uvec3(texel1.zw, texel2.x)));
    precise float u = c.x * b.y - c.y * b.x;
    precise float v = a.x * c.y - a.y * c.x;
    precise float w = b.x * a.y - b.y * a.x;
    bool inside = !(min(u, min(v, w)) < 0 && max(u, max(v, w)) > 0);
    // Zero where seen edge-on, or without area.
    float determinant = u + v + w;
    float scale = 1 / determinant;
    float t = (u * a.z + v * b.z + w * c.z) * scale;
    vec2 barycentrics = vec2(v, w) * scale;
    bool nearer = t < hit.t || (t == hit.t && triangle < triangle_index(hit));
    bool found = wanted && inside && determinant != 0 && t >= t_min && nearer;
    if (found && is_hole(triangle, barycentrics)) found = false;
    hit.t = found ? t : hit.t;
    hit.triangle = found ? triangle | (determinant < 0 ? BACK_FACE : 0u) : hit.triangle;
    hit.barycentrics = found ? barycentrics : hit.barycentrics;
    return found;
}

void sort(inout uint a, inout uint b)
{
    uint least = min(a, b);
    b = max(a, b);
    a = least;
}

// Levels of a tree; the builder keeps within it. Each level puts at most one entry on the stack.
const uint BVH_LEVELS = 48;

// The closest hit, or any hit where `any` is true (a constant at each call).
//
// Each turn takes one node and one triangle, from two queues, so that threads in lockstep have both to do most of the
// time; in turns of a node or a leaf they mostly wait for each other. `cargo bench --bench trace` on lavapipe 25, two quiet
// cores, as multiples of obvhs's CWBVH traversal on the CPU (2026-11): closest hits 1.50 with 64k triangles, 1.62 with 1M;
// any hit 1.33 and 0.98. Of the trials, per CPU-second with 64k where this kernel had 1.9: tables in storage buffers of
// 64-bit words 1.1 (a load there is a test and a branch
// per thread, a texel fetch is not); a node or a leaf by turns 0.75 in such buffers; bounds in f32 0.35 to 0.45, eight
// children less; leaves of one triangle 1.7; new rays for threads that are done, every 8 to 24 turns, 1.85.
// Where `both` is true, the result is the nearest hit at least `gap` behind `first`, the nearest of all; `lit`: on a lit side.
Hit walk(Ray ray, bool any, bool both, bool lit, float gap, inout Hit first, inout PassedOver passed_over)
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
    bvec3 negative = lessThan(inverse, vec3(0));
    vec3 origin = abs(ray.origin);
    vec3 slack = abs(inverse) * (BVH_SLACK * max(origin.x, max(origin.y, origin.z)));
    vec3 enter = -ray.origin * inverse - slack;
    vec3 leave = -ray.origin * inverse + slack;

    uint stack[BVH_LEVELS];
    uint depth = 0;
    uint node = 0;           // to be visited next, or NO_NODE
    const uint NO_NODE = 0xffffffffu;
    uint group = 0;          // its siblings still to visit: first inner child << 8 | count << 6 | children, nearest lowest
    uint leaf = 0, next = 0; // triangles still to test: first slot << 8 | a bit a triangle
    while (true) {
        bool visit = next == 0;
        if (visit && node == NO_NODE) {
            if (group == 0 && depth > 0) group = stack[--depth];
            if (group != 0) {
                node = (group >> 8) + (group & 3);
                bool last = (group & 0xc0u) == 0x40u;
                group = last ? 0 : (group & 0xffffff00u) | ((group & 0xc0u) - 0x40u) | (group >> 2 & 0xfu);
            }
        }
        if (visit && node != NO_NODE) {
            uvec4 texel0 = bvh_node_texel(NODE_TEXELS * node);
            uvec4 texel1 = bvh_node_texel(NODE_TEXELS * node + 1);
            uvec4 texel2 = bvh_node_texel(NODE_TEXELS * node + 2);
            vec3 cell = grid_cell(texel0.w) * inverse;
            vec3 node_enter = uintBitsToFloat(texel0.xyz) * inverse + enter;
            vec3 node_leave = uintBitsToFloat(texel0.xyz) * inverse + leave;
            uvec3 lows = uvec3(texel1.xz, texel2.x), highs = uvec3(texel1.yw, texel2.y);
            uvec3 nears = mix(lows, highs, negative), fars = mix(highs, lows, negative);

            // Inner children as distance with the child in the last two bits; leaves as bits of their triangles.
            uint keys[4];
            uint inner_count = 0, bits = 0, slot = 0;
            [[unroll]] for (uint k = 0; k < 4; ++k) {
                vec3 near = vec3(nears >> 8 * k & 0xffu) * cell + node_enter;
                vec3 far = vec3(fars >> 8 * k & 0xffu) * cell + node_leave;
                float t_near = max(max(near.x, near.y), max(near.z, ray.t_min));
                bool crossed = t_near <= min(min(far.x, far.y), min(far.z, hit.t));
                uint kind = child_kind(texel0.w, k);
                bool inner = crossed && kind == KIND_INNER;
                keys[k] = inner ? (floatBitsToUint(t_near) & ~3u) | k : 0xffffffffu;
                inner_count += inner ? 1 : 0;
                uint count = kind == KIND_INNER ? 0 : kind;
                bits |= crossed ? (1u << count) - 1 << slot : 0;
                slot += count;
            }
            sort(keys[0], keys[1]);
            sort(keys[2], keys[3]);
            sort(keys[0], keys[2]);
            sort(keys[1], keys[3]);
            sort(keys[1], keys[2]);

            // Go on with the nearest; the siblings of the level above wait on the stack.
            node = inner_count > 0 ? texel2.z + (keys[0] & 3) : NO_NODE;
            if (inner_count > 1) {
                if (group != 0) stack[depth++] = group;
                group = texel2.z << 8 | inner_count - 1 << 6 | (keys[1] & 3) | (keys[2] & 3) << 2 | (keys[3] & 3) << 4;
            }
            next = bits != 0 ? texel2.w << 8 | bits : 0;
        }
        if (leaf == 0) {
            leaf = next;
            next = 0;
        }
        bool test = leaf != 0;
        uint slot = test ? (leaf >> 8) + findLSB(leaf & 0xffu) : 0;
        leaf &= leaf - 1;
        if ((leaf & 0xffu) == 0) {
            leaf = next;
            next = 0;
        }
        Hit before = hit;
        bool found = intersect_triangle(frame, slot, test, ray.t_min, hit);
        if (found && any) break;
        if (both && found) keep_both(before, gap, lit, first, hit, passed_over);
        if (leaf == 0 && node == NO_NODE && group == 0 && depth == 0) break;
    }
    return hit;
}

Hit traverse(Ray ray, bool any)
{
    Hit first;
    PassedOver passed_over;
    return walk(ray, any, false, false, 0.0, first, passed_over);
}
#endif
