//! Triangle shapes the built-in scenes are made of: boxes, walls with openings, bodies of revolution, tubes,
//! isosurfaces. Plain geometry in metres, wound counter-clockwise seen from outside; no materials and no scene graph.
//!
//! The same call gives the same bits on every run: angles go through double precision, everything after is basic
//! arithmetic.

mod flat;
mod isosurface;
mod round;

pub use flat::{Frame, Opening};
pub use isosurface::isosurface;
pub use round::{circle, sin_cos, smooth_path};

use glam::{Mat3, Vec2, Vec3};
use std::collections::HashMap;

/// Indexed triangles. `normals` (unit length) and `uv` have one entry per position.
#[derive(Debug, Clone, Default)]
pub struct Shape {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub uv: Vec<Vec2>,
    pub triangles: Vec<[u32; 3]>,
}

impl Shape {
    pub fn vertex(&mut self, position: Vec3, normal: Vec3, uv: Vec2) -> u32 {
        self.positions.push(position);
        self.normals.push(normal);
        self.uv.push(uv);
        self.positions.len() as u32 - 1
    }

    /// Adds a triangle unless two of its corners coincide (as at the pole of a sphere).
    pub fn triangle(&mut self, [a, b, c]: [u32; 3]) {
        let [p, q, r] = [a, b, c].map(|i| self.positions[i as usize]);
        if p != q && q != r && r != p {
            self.triangles.push([a, b, c]);
        }
    }

    /// Two triangles over corners in counter-clockwise order, cut along the shorter diagonal.
    pub fn quad_of(&mut self, [a, b, c, d]: [u32; 4]) {
        let diagonal = |i: u32, j: u32| self.positions[i as usize].distance_squared(self.positions[j as usize]);
        if diagonal(a, c) <= diagonal(b, d) {
            self.triangle([a, b, c]);
            self.triangle([a, c, d]);
        } else {
            self.triangle([a, b, d]);
            self.triangle([b, c, d]);
        }
    }

    pub fn append(&mut self, other: Self) {
        let first = self.positions.len() as u32;
        self.positions.extend(other.positions);
        self.normals.extend(other.normals);
        self.uv.extend(other.uv);
        self.triangles.extend(other.triangles.into_iter().map(|t| t.map(|i| i + first)));
    }

    pub fn with(mut self, other: Self) -> Self {
        self.append(other);
        self
    }

    /// All parts in one shape.
    pub fn union(parts: impl IntoIterator<Item = Self>) -> Self {
        parts.into_iter().fold(Self::default(), Self::with)
    }

    pub fn moved(mut self, by: Vec3) -> Self {
        self.positions.iter_mut().for_each(|p| *p += by);
        self
    }

    /// Applies a linear map; a mirroring one keeps the outside outside.
    pub fn transformed(mut self, map: Mat3) -> Self {
        let normal_map = map.inverse().transpose();
        self.positions.iter_mut().for_each(|p| *p = map * *p);
        self.normals.iter_mut().for_each(|n| *n = (normal_map * *n).normalize_or(Vec3::Y));
        if map.determinant() < 0.0 {
            self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        self
    }

    pub fn scaled(self, factors: Vec3) -> Self {
        self.transformed(Mat3::from_diagonal(factors))
    }

    /// Turned about +X by degrees, counter-clockwise seen from the tip of the axis.
    pub fn turned_x(self, degrees: f32) -> Self {
        let (sin, cos) = sin_cos(degrees / 360.0);
        self.transformed(Mat3::from_cols(Vec3::X, Vec3::new(0.0, cos, sin), Vec3::new(0.0, -sin, cos)))
    }

    /// Turned about +Y by degrees.
    pub fn turned_y(self, degrees: f32) -> Self {
        let (sin, cos) = sin_cos(degrees / 360.0);
        self.transformed(Mat3::from_cols(Vec3::new(cos, 0.0, -sin), Vec3::Y, Vec3::new(sin, 0.0, cos)))
    }

    /// Turned about +Z by degrees.
    pub fn turned_z(self, degrees: f32) -> Self {
        let (sin, cos) = sin_cos(degrees / 360.0);
        self.transformed(Mat3::from_cols(Vec3::new(cos, sin, 0.0), Vec3::new(-sin, cos, 0.0), Vec3::Z))
    }

    /// Inside out.
    pub fn flipped(mut self) -> Self {
        self.normals.iter_mut().for_each(|n| *n = -*n);
        self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        self
    }

    /// Vertices with the same position, normal and texture coordinate become one; those of no triangle go.
    pub fn welded(self) -> Self {
        let mut out = Self::default();
        let mut seen: HashMap<[u32; 8], u32> = HashMap::new();
        for triangle in &self.triangles {
            let corners = triangle.map(|i| {
                let (p, n, t) = (self.positions[i as usize], self.normals[i as usize], self.uv[i as usize]);
                // `+ 0.0` makes negative zero positive, so that both zeros meet.
                let key = [p.x, p.y, p.z, n.x, n.y, n.z, t.x, t.y].map(|x| (x + 0.0).to_bits());
                *seen.entry(key).or_insert_with(|| out.vertex(p, n, t))
            });
            out.triangle(corners);
        }
        out
    }

    /// Normals from the triangles around each vertex, weighted by area.
    pub fn smoothed(mut self) -> Self {
        self.normals.iter_mut().for_each(|n| *n = Vec3::ZERO);
        for &[a, b, c] in &self.triangles {
            let [p, q, r] = [a, b, c].map(|i| self.positions[i as usize]);
            let area_normal = (q - p).cross(r - p);
            for i in [a, b, c] {
                self.normals[i as usize] += area_normal;
            }
        }
        self.normals.iter_mut().for_each(|n| *n = n.normalize_or(Vec3::Y));
        self
    }

    /// Smallest and largest coordinate; (0, 0) for an empty shape.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let first = self.positions.first().copied().unwrap_or_default();
        self.positions.iter().fold((first, first), |(low, high), p| (low.min(*p), high.max(*p)))
    }
}
