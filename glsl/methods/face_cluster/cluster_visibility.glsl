#ifndef FACE_CLUSTER_VISIBILITY
#define FACE_CLUSTER_VISIBILITY
// Multiresolution visibility: a walk over the clusters of all meshes that stops where a cluster's shadow is too small to
// matter, and attenuates there by the cluster's opacity.                                       [Gobbetti2003 3.3.1]
// Bindings 17 to 20 of every kernel that decides pairs.
layout(set = 0, binding = 17, scalar) readonly buffer Clusters { FaceCluster clusters[]; };
layout(set = 0, binding = 18, scalar) readonly buffer Instances { ClusterInstance instances[]; };
layout(set = 0, binding = 19, scalar) readonly buffer Faces { uint tree_faces[]; };
layout(set = 0, binding = 20, scalar) readonly buffer Positions { vec3 positions[]; };

// Of ranges of places, which are nested or apart; one without places is in none.
bool contains(uint first, uint count, uint other, uint other_count) { return other_count > 0 && other >= first && other + other_count <= first + count; }

// Share of area that the cluster's faces cover of its box, seen along a unit direction; both sides of a face block.
float opacity(FaceCluster c, vec3 d)
{
    float front = max(d.x, 0.0) * c.facing[0] + max(-d.x, 0.0) * c.facing[1] + max(d.y, 0.0) * c.facing[2]
                + max(-d.y, 0.0) * c.facing[3] + max(d.z, 0.0) * c.facing[4] + max(-d.z, 0.0) * c.facing[5];
    float back = max(-d.x, 0.0) * c.facing[0] + max(d.x, 0.0) * c.facing[1] + max(-d.y, 0.0) * c.facing[2]
               + max(d.y, 0.0) * c.facing[3] + max(-d.z, 0.0) * c.facing[4] + max(d.z, 0.0) * c.facing[5];
    vec3 h = c.half_extent, a = abs(d);
    float of_box = 4.0 * (a.x * h.y * h.z + a.y * h.z * h.x + a.z * h.x * h.y);
    return min(max(front, back) / max(of_box, 1e-30), 1.0);
}

// Whether the open segment from x to y meets the triangle.                                     [Moller1997]
bool meets(vec3 x, vec3 y, vec3 a, vec3 b, vec3 c)
{
    vec3 d = y - x, ab = b - a, ac = c - a, p = cross(d, ac);
    float det = dot(ab, p);
    if (det == 0.0) return false;
    vec3 s = x - a, q = cross(s, ab);
    float u = dot(s, p) / det, v = dot(d, q) / det, t = dot(ac, q) / det;
    return u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 1e-4 && t < 1.0 - 1e-4;
}

// Share of the way from x to y that is free; `width` is how far receiver nodes stand apart, metres.
float free_share(vec3 x, vec3 y, float width)
{
    float share = 1.0;
    for (uint k = 0; k < instances.length() && share > 1e-3; ++k) {
        ClusterInstance inst = instances[k];
        if (inst.is_back != 0) continue;
        mat3 tree_from_world = transpose(mat3(inst.world_from_tree[0], inst.world_from_tree[1], inst.world_from_tree[2])) / (inst.scale * inst.scale);
        vec3 origin = tree_from_world * (x - inst.world_from_tree[3]), way = tree_from_world * (y - x);
        uint node = inst.first_cluster, end = cluster_skips[node];
        while (node < end && share > 1e-3) {
            FaceCluster c = clusters[node];
            uint first = inst.first_triangle + first_face(c), count = face_count(c);
            uint skip = cluster_skips[node];
            vec4 to_box = vec4(-c.rotation.xyz, c.rotation.w);
            vec3 o = rotated(to_box, origin - c.center), d = rotated(to_box, way);
            vec3 inverse = 1.0 / mix(d, vec3(1e-20), equal(d, vec3(0.0)));
            vec3 near = (-sign(inverse) * c.half_extent - o) * inverse, far = (sign(inverse) * c.half_extent - o) * inverse;
            float enter = max(max(near.x, near.y), max(near.z, 1e-4)), leave = min(min(far.x, far.y), min(far.z, 1.0 - 1e-4));
            bool passes = contains(passed_places.x, passed_places.y, first, count) || contains(passed_places.z, passed_places.w, first, count);
            if (passes || enter > leave) {
                node = skip;
                continue;
            }
            // What holds the receiver or the shooter is looked into; so is what casts a shadow wider than nodes see.
            bool holds = contains(first, count, passed_places.x, passed_places.y) || contains(first, count, passed_places.z, passed_places.w);
            float shadow = 2.0 * length(c.half_extent) * inst.scale / max(1.0 - 0.5 * (enter + leave), 1e-3);
            bool is_leaf = skip == node + 1;
            if (!is_leaf && (holds || shadow > width)) {
                ++node;
                continue;
            }
            if (is_leaf && count == 1) {
                uvec3 v = triangles[inst.first_triangle + tree_faces[inst.first_face + first_face(c)]];
                if (meets(x, y, positions[v.x], positions[v.y], positions[v.z])) share = 0.0;
            } else if (!holds) {
                share *= 1.0 - opacity(c, d / length(d));
            }
            node = skip;
        }
    }
    return share;
}
#endif
