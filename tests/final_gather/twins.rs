//! The gather as a plain sum over all leaves, in double precision.

use glam::{DVec3, Vec3};
use linklight::gpu::shaders::types::SenderLeaf;
use linklight::stages::sender_tree;
use std::f64::consts::PI;

/// Form factor from a point with a unit normal to a leaf: Lambert's sum over the edges of what is above the horizon.
pub fn form_factor(point: DVec3, normal: DVec3, leaf: &SenderLeaf) -> f64 {
    let mut corners: Vec<DVec3> = sender_tree::corners(leaf).iter().map(|c| c.as_dvec3() - point).collect();
    if leaf.is_triangle != 0 {
        corners.pop();
    }
    let facing = (corners[1] - corners[0]).cross(corners[2] - corners[0]).dot(corners[0]);
    if facing >= 0.0 {
        return 0.0;
    }
    let mut kept = Vec::new();
    for (k, &b) in corners.iter().enumerate() {
        let a = corners[(k + corners.len() - 1) % corners.len()];
        let (height_a, height_b) = (a.dot(normal), b.dot(normal));
        if (height_a > 0.0) != (height_b > 0.0) {
            kept.push(a.lerp(b, height_a / (height_a - height_b)));
        }
        if height_b > 0.0 {
            kept.push(b);
        }
    }
    let edge = |a: DVec3, b: DVec3| {
        let across = a.cross(b);
        if across.length() > 0.0 { across.length().atan2(a.dot(b)) * across.normalize().dot(normal) } else { 0.0 }
    };
    let sum: f64 = (0..kept.len()).map(|k| edge(kept[(k + kept.len() - 1) % kept.len()], kept[k])).sum();
    sum.abs() / (2.0 * PI)
}

/// Irradiance at a point from all leaves, W/m2.
pub fn irradiance(point: DVec3, normal: DVec3, leaves: &[SenderLeaf], radiosity: &[Vec3]) -> DVec3 {
    let sum = leaves.iter().zip(radiosity).map(|(leaf, b)| form_factor(point, normal, leaf) * b.as_dvec3());
    sum.sum()
}
