//! Plain, slow versions of what the method's passes compute.

use glam::{DMat3, DVec3, Vec3};
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

/// Directions through the centres of all bins.
pub fn directions(n: u32) -> Vec<DVec3> {
    let at = move |cell: u32| (2.0 * f64::from(cell) + 1.0) / f64::from(n) - 1.0;
    (0..6 * n * n)
        .map(move |bin| bins::face_direction(bin / (n * n), at(bin % n), at(bin / n % n)).normalize())
        .collect()
}

/// The triangles of a scene, and the leaf of each vertex's front and back.
pub struct Cells<'a> {
    pub positions: &'a [Vec3],
    pub triangles: &'a [[u32; 3]],
    pub fronts: &'a [u32],
    /// [`EMPTY`] where the surface is one-sided.
    pub backs: &'a [u32],
}

impl Cells<'_> {
    /// What each direction meets first from `origin`: its distance, and the leaf with the largest barycentric coordinate
    /// there, with [`BACK`] where it is met from behind. Over all triangles, in double precision.
    pub fn nearest(&self, origin: Vec3, n: u32) -> Vec<(f64, u32)> {
        let directions = directions(n);
        let mut row: Vec<(f64, u32)> = vec![(f64::INFINITY, EMPTY); directions.len()];
        for &triangle in self.triangles {
            let [a, b, c] = triangle.map(|v| (self.positions[v as usize] - origin).as_dvec3());
            let planes = [b.cross(c), c.cross(a), a.cross(b)];
            let volume = a.dot(planes[0]);
            for (nearest, direction) in row.iter_mut().zip(&directions) {
                let w = planes.map(|plane| plane.dot(*direction) * volume.signum());
                let t = volume.abs() / (w[0] + w[1] + w[2]);
                if w.iter().any(|&w| w < 0.0) || !(t > 0.0 && t < nearest.0) {
                    continue;
                }
                let corner = (0..3).max_by(|&i, &j| w[i].total_cmp(&w[j])).unwrap();
                let vertex = triangle[corner] as usize;
                let leaf = match (volume > 0.0, self.backs[vertex]) {
                    (false, _) => self.fronts[vertex],
                    (true, EMPTY) => self.fronts[vertex] | BACK,
                    (true, back) => back,
                };
                *nearest = (t, leaf);
            }
        }
        row
    }
}

/// Weight of each bin at a receiver along the world's axes: the integral of the cosine over it, sr, scaled to pi.
pub fn weights(normal: Vec3, vectors: &[Vec3]) -> Vec<f64> {
    let raw = vectors.iter().map(|v| v.as_dvec3().dot(normal.as_dvec3()).max(0.0));
    let total: f64 = raw.clone().sum();
    raw.map(|weight| weight * std::f64::consts::PI / total).collect()
}

/// How far the highest corner of a bin lies above the plane across a normal.
pub fn highest(bin: u32, normal: Vec3, n: u32) -> f32 {
    let at = |cell: u32| 2.0 * f64::from(cell) / f64::from(n) - 1.0;
    let corner = |k: u32| bins::face_direction(bin / (n * n), at(bin % n + (k & 1)), at(bin / n % n + (k >> 1)));
    (0..4).map(|k| corner(k).as_vec3().dot(normal)).fold(f32::MIN, f32::max)
}
