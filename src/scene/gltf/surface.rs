//! What a file may leave out of a surface: flat normals where it has none (glTF 2.0, 3.7.2.1), unit length where it
//! has others.

use crate::scene::{MorphTarget, Primitive};
use glam::Vec3;

/// Keeps the vertices `sources` in that order, each as often as it is named; triangles are left alone.
pub fn select_vertices(primitive: &mut Primitive, sources: &[u32]) {
    fn select<T: Copy>(values: &mut Vec<T>, sources: &[u32]) {
        if !values.is_empty() {
            *values = sources.iter().map(|source| values[*source as usize]).collect();
        }
    }
    select(&mut primitive.positions, sources);
    select(&mut primitive.normals, sources);
    select(&mut primitive.tangents, sources);
    primitive.uv.iter_mut().for_each(|uv| select(uv, sources));
    select(&mut primitive.colors, sources);
    select(&mut primitive.joints, sources);
    select(&mut primitive.joint_weights, sources);
    for target in &mut primitive.morph_targets {
        select(&mut target.positions, sources);
        select(&mut target.normals, sources);
        select(&mut target.tangents, sources);
    }
}

/// The most bytes that giving every triangle its own vertices can add.
pub fn unsharing_bytes(primitive: &Primitive) -> u64 {
    let bytes = |len: usize, element: usize| if len == 0 { 0 } else { element as u64 };
    let vertex_bytes = 12
        + 12
        + 16
        + bytes(primitive.uv[0].len(), 8)
        + bytes(primitive.uv[1].len(), 8)
        + bytes(primitive.colors.len(), 16)
        + bytes(primitive.joints.len(), 16)
        + bytes(primitive.joint_weights.len(), 32)
        + 36 * primitive.morph_targets.len() as u64;
    primitive.triangles.len() as u64 * 3 * vertex_bytes
}

/// Normals this close (by their dot product) are one normal: coplanar triangles keep sharing their vertices.
const SAME_NORMAL: f32 = 1.0 - 1e-6;

/// Gives every triangle its own normal. A vertex is shared by the triangles that lie in one plane, and is doubled where
/// they do not. Morph targets get the change of the flat normal when they act alone at full weight.
pub fn flat_normals(primitive: &mut Primitive) {
    let normals: Vec<Vec3> = primitive.triangles.iter().map(|t| face_normal(primitive, *t)).collect();
    // Triangles in one plane may leave it in different directions once a target acts.
    let may_share = primitive.morph_targets.is_empty();
    let key = |corner: usize| normals[corner / 3];
    split_vertices(primitive, key, |a, b| may_share && a.dot(b) >= SAME_NORMAL);

    primitive.normals = vec![Vec3::Y; primitive.positions.len()];
    for (triangle, normal) in primitive.triangles.iter().zip(&normals) {
        triangle.iter().for_each(|vertex| primitive.normals[*vertex as usize] = *normal);
    }
    let mut targets = std::mem::take(&mut primitive.morph_targets);
    for target in &mut targets {
        flat_normal_deltas(primitive, target);
    }
    primitive.morph_targets = targets;
}

fn face_normal(primitive: &Primitive, triangle: [u32; 3]) -> Vec3 {
    normal_of(triangle.map(|vertex| primitive.positions[vertex as usize]))
}

/// In double precision, since the squares of large or small single-precision lengths leave their range.
fn normal_of([a, b, c]: [Vec3; 3]) -> Vec3 {
    let [a, b, c] = [a, b, c].map(|corner| corner.as_dvec3());
    (b - a).cross(c - a).try_normalize().map_or(Vec3::Y, |normal| normal.as_vec3())
}

fn flat_normal_deltas(primitive: &Primitive, target: &mut MorphTarget) {
    if target.positions.is_empty() {
        return;
    }
    target.normals = vec![Vec3::ZERO; primitive.positions.len()];
    for triangle in &primitive.triangles {
        let moved = triangle.map(|v| primitive.positions[v as usize] + target.positions[v as usize]);
        let normal = normal_of(moved);
        triangle.iter().for_each(|v| target.normals[*v as usize] = normal - primitive.normals[*v as usize]);
    }
}

/// Doubles vertices so that all corners (numbered along the triangles) of a vertex have the `same` key.
pub fn split_vertices<K: Copy>(primitive: &mut Primitive, key: impl Fn(usize) -> K, same: impl Fn(K, K) -> bool) {
    const NONE: u32 = u32::MAX;
    // Per source vertex the first of its copies, and per copy the next: a linked list in two arrays.
    let mut first_copy = vec![NONE; primitive.positions.len()];
    let mut copies: Vec<(u32, K, u32)> = Vec::with_capacity(primitive.positions.len());
    let mut triangles = std::mem::take(&mut primitive.triangles);
    for (corner, vertex) in triangles.as_flattened_mut().iter_mut().enumerate() {
        let key = key(corner);
        let source = *vertex;
        let mut copy = first_copy[source as usize];
        let mut steps = 0;
        while copy != NONE && !same(copies[copy as usize].1, key) {
            // A vertex with thousands of copies (the hub of a great fan) is not searched to its end.
            copy = if steps < 64 { copies[copy as usize].2 } else { NONE };
            steps += 1;
        }
        if copy == NONE {
            copy = copies.len() as u32;
            copies.push((source, key, first_copy[source as usize]));
            first_copy[source as usize] = copy;
        }
        *vertex = copy;
    }
    primitive.triangles = triangles;
    let sources: Vec<u32> = copies.iter().map(|copy| copy.0).collect();
    select_vertices(primitive, &sources);
}

/// Brings the file's normals to unit length. Those without a direction take the area-weighted mean of the triangles
/// around. Returns how many did.
pub fn unit_normals(primitive: &mut Primitive) -> usize {
    let mut lost = Vec::new();
    for (vertex, normal) in primitive.normals.iter_mut().enumerate() {
        match normal.as_dvec3().try_normalize() {
            Some(unit) => *normal = unit.as_vec3(),
            None => lost.push(vertex as u32),
        }
    }
    if lost.is_empty() {
        return 0;
    }
    let mut sums = vec![glam::DVec3::ZERO; primitive.positions.len()];
    for triangle in &primitive.triangles {
        let [a, b, c] = triangle.map(|vertex| primitive.positions[vertex as usize].as_dvec3());
        let twice_area = (b - a).cross(c - a);
        triangle.iter().for_each(|vertex| sums[*vertex as usize] += twice_area);
    }
    for vertex in &lost {
        let mean = sums[*vertex as usize].try_normalize();
        primitive.normals[*vertex as usize] = mean.map_or(Vec3::Y, |normal| normal.as_vec3());
    }
    lost.len()
}

/// Brings the file's tangents to unit length and their handedness to +1 or -1.
pub fn unit_tangents(primitive: &mut Primitive) {
    for (tangent, normal) in primitive.tangents.iter_mut().zip(&primitive.normals) {
        let direction = tangent.truncate().try_normalize().unwrap_or_else(|| normal.any_orthonormal_vector());
        *tangent = direction.extend(if tangent.w < 0.0 { -1.0 } else { 1.0 });
    }
}
