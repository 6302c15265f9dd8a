//! Plain, slow versions of what the method's passes compute.

use glam::{DMat3, DVec3, Vec3};
use linklight::gpu::shaders::types::{Receiver, Surfel};
use linklight::methods::implicit_visibility::bins;

/// What turns its back, as in a winner.
pub const BACK: u32 = 1 << 31;
pub const EMPTY: u32 = u32::MAX;

/// The surface of a leaf: covariance, mean and area of the thirds of the triangles around vertex `v`, by brute force:
/// each third is cut into many small triangles whose middles are summed.
pub fn cell_moments(v: u32, positions: &[Vec3], triangles: &[[u32; 3]]) -> (f64, DVec3, DMat3) {
    const CUTS: u32 = 100;
    let (mut area, mut sum, mut squares) = (0.0, DVec3::ZERO, DMat3::ZERO);
    for triangle in triangles.iter().filter(|t| t.contains(&v)) {
        let corner = triangle.iter().position(|&c| c == v).unwrap();
        let [a, b, c] = [0, 1, 2].map(|k| positions[triangle[(corner + k) % 3] as usize].as_dvec3());
        let piece = 0.5 * (b - a).cross(c - a).length() / f64::from(CUTS * CUTS);
        for i in 0..CUTS {
            for j in 0..CUTS - i {
                for (upside, is_whole) in [(1.0, true), (2.0, i + j + 2 <= CUTS)] {
                    let (s, t) = (
                        (f64::from(i) + upside / 3.0) / f64::from(CUTS),
                        (f64::from(j) + upside / 3.0) / f64::from(CUTS),
                    );
                    // The third of corner a: where its weight is the largest.
                    let weight = 1.0 - s - t;
                    if !is_whole || weight < s || weight < t {
                        continue;
                    }
                    let at = a + s * (b - a) + t * (c - a);
                    area += piece;
                    sum += piece * at;
                    squares += DMat3::from_cols(at * at.x, at * at.y, at * at.z) * piece;
                }
            }
        }
    }
    let mean = sum / area;
    (area, mean, squares * (1.0 / area) - DMat3::from_cols(mean * mean.x, mean * mean.y, mean * mean.z))
}

/// Nearest leaf in each bin of each leaf over all pairs: (distance, winner), by rays through the bins' centres against
/// the ellipses of all surfels, in double precision.
pub fn all_pairs(surfels: &[Surfel], receivers: &[Receiver], trees: &[u32], n: u32) -> Vec<Vec<(f64, u32)>> {
    let directions: Vec<DVec3> = (0..6 * n * n)
        .map(|bin| {
            let at = |cell: u32| (2.0 * f64::from(cell) + 1.0) / f64::from(n) - 1.0;
            bins::face_direction(bin / (n * n), at(bin % n), at(bin / n % n)).normalize()
        })
        .collect();
    let row = |(leaf, at): (usize, &Receiver)| {
        let mut row = vec![(f64::INFINITY, EMPTY); directions.len()];
        for (sender, s) in surfels[..receivers.len()].iter().enumerate() {
            let offset = (s.centre - at.origin).as_dvec3();
            let plane = s.normal.as_dvec3().dot(offset);
            let is_beside = trees[leaf] == trees[sender]
                && offset.length() < f64::from(surfels[leaf].radius + s.radius)
                && plane > 0.0;
            if sender == leaf || is_beside {
                continue;
            }
            for (bin, direction) in directions.iter().enumerate() {
                let t = plane / s.normal.as_dvec3().dot(*direction);
                if !(t > 0.0 && t < row[bin].0) {
                    continue;
                }
                let x = t * direction - offset;
                if s.g1.as_dvec3().dot(x).powi(2) + s.g2.as_dvec3().dot(x).powi(2) <= 1.0 {
                    row[bin] = (t, sender as u32 | if plane > 0.0 { BACK } else { 0 });
                }
            }
        }
        row
    };
    receivers.iter().enumerate().map(row).collect()
}

/// Weight of each bin at a receiver along the world's axes: the integral of the cosine over it, sr, scaled to pi.
pub fn weights(normal: Vec3, vectors: &[Vec3]) -> Vec<f64> {
    let raw = vectors.iter().map(|v| v.as_dvec3().dot(normal.as_dvec3()).max(0.0));
    let total: f64 = raw.clone().sum();
    raw.map(|weight| weight * std::f64::consts::PI / total).collect()
}
