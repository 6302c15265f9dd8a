//! Vertex attributes at a point of a triangle.

use glam::{Vec3, Vec4};

use crate::scene::geometry::Geometry;

/// A new vertex as a weighted mean of up to three old ones; weights sum to one.
#[derive(Debug, Clone, Copy)]
pub struct Source {
    pub vertices: [u32; 3],
    pub weights: [f32; 3],
}

impl Source {
    /// Between two vertices, `t` from the first.
    pub fn between([a, b]: [u32; 2], t: f32) -> Self {
        Self { vertices: [a, b, a], weights: [1.0 - t, t, 0.0] }
    }

    pub fn mix<T>(&self, values: &[T]) -> T
    where
        T: Copy + std::ops::Mul<f32, Output = T> + std::ops::Add<Output = T>,
    {
        let [a, b, c] = self.vertices.map(|vertex| values[vertex as usize]);
        a * self.weights[0] + b * self.weights[1] + c * self.weights[2]
    }

    /// The old vertex that weighs most, the first of equals.
    fn nearest(&self) -> u32 {
        let heaviest = (1..3).fold(0, |best, k| if self.weights[k] > self.weights[best] { k } else { best });
        self.vertices[heaviest]
    }

    /// Unit mean of unit vectors; the nearest's where they cancel.
    pub fn mix_unit(&self, values: &[Vec3]) -> Vec3 {
        self.mix(values).try_normalize().unwrap_or(values[self.nearest() as usize])
    }

    /// Unit tangent with the nearest vertex's handedness.
    pub fn mix_tangent(&self, values: &[Vec4]) -> Vec4 {
        let nearest = values[self.nearest() as usize];
        self.mix(values).truncate().try_normalize().map_or(nearest, |tangent| tangent.extend(nearest.w))
    }

    /// The eight strongest joints of the old vertices' influences, their weights made to sum to one. `first` is the
    /// part's first influence, `first_vertex` its first vertex.
    pub fn mix_influences(&self, geometry: &Geometry, first: u32, first_vertex: u32) -> ([u32; 8], [f32; 8]) {
        let mut merged: Vec<(u32, f32)> = Vec::with_capacity(24);
        for (vertex, share) in self.vertices.into_iter().zip(self.weights) {
            let influence = (first + vertex - first_vertex) as usize;
            let slots = geometry.skin_joints[influence].into_iter().zip(geometry.skin_weights[influence]);
            for (joint, weight) in slots {
                match merged.iter_mut().find(|(known, _)| *known == joint) {
                    Some((_, sum)) => *sum += share * weight,
                    None => merged.push((joint, share * weight)),
                }
            }
        }
        merged.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        merged.truncate(8);
        let sum: f32 = merged.iter().map(|(_, weight)| weight).sum();
        let (mut joints, mut weights) = ([merged[0].0; 8], [0.0; 8]);
        for (slot, (joint, weight)) in merged.into_iter().enumerate() {
            joints[slot] = joint;
            weights[slot] = if sum > 0.0 { weight / sum } else { weight };
        }
        (joints, weights)
    }
}
