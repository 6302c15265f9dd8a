//! The distinct edges of a triangle list, each with a direction and a length that its end positions alone decide.

use glam::Vec3;
use rayon::prelude::*;

use crate::scene::adjacency::position_key;

#[derive(Debug, Default)]
pub struct Edges {
    /// End vertices, ordered by position: edges that coincide but are indexed apart run the same way.
    pub ends: Vec<[u32; 2]>,
    /// Metres.
    pub lengths: Vec<f64>,
    /// Edge of each triangle's side k, from corner k to corner k + 1.
    pub of_triangle: Vec<[u32; 3]>,
}

impl Edges {
    pub fn of(triangles: &[[u32; 3]], positions: &[Vec3]) -> Self {
        let mut sides: Vec<(u64, u32)> = Vec::with_capacity(triangles.len() * 3);
        for (triangle, corners) in triangles.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                let key = u64::from(a.min(b)) << 32 | u64::from(a.max(b));
                sides.push((key, (triangle * 3 + k) as u32));
            }
        }
        sides.par_sort_unstable();

        let mut edges = Self { of_triangle: vec![[0; 3]; triangles.len()], ..Self::default() };
        let mut previous = None;
        for (key, side) in sides {
            if previous != Some(key) {
                previous = Some(key);
                let (a, b) = ((key >> 32) as u32, key as u32);
                let [from, to] = [a, b].map(|vertex| positions[vertex as usize]);
                let in_order = position_key(from) <= position_key(to);
                edges.ends.push(if in_order { [a, b] } else { [b, a] });
                // The same bits either way round: differences only change sign.
                edges.lengths.push(from.as_dvec3().distance(to.as_dvec3()));
            }
            edges.of_triangle[side as usize / 3][side as usize % 3] = edges.ends.len() as u32 - 1;
        }
        edges
    }
}
