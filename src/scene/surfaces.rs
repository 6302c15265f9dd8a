//! The smooth surfaces of a geometry: triangles that share vertices, whether they lie in one plane, and whether they are
//! the outside of a solid.
//!
//! Hard edges have split vertices, so a wall is a surface of its own. Looks at the rest pose alone.

use std::collections::HashMap;

use glam::Vec3;

use super::adjacency::weld;
use super::geometry::Geometry;

/// Normals of a flat surface agree within this (sine of the angle), and its vertices lie this close to its plane, as a
/// share of its extent.
const FLATNESS: f32 = 1e-4;

/// See the [module](self).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Surfaces {
    /// Surface of each vertex, numbered from 0 in order of their first vertex.
    pub of_vertex: Vec<u32>,
    /// Per surface: all of it lies in one plane.
    pub is_flat: Vec<bool>,
    /// Per surface: it belongs to a closed mesh that looks outwards, so that no light ever meets its back.
    pub is_solid: Vec<bool>,
}

impl Surfaces {
    /// `positions`: world space, bit-equal where vertices stand at one place.
    pub fn new(geometry: &Geometry, positions: &[Vec3]) -> Self {
        let mut joined = Disjoint::new(positions.len());
        for &[a, b, c] in &geometry.triangles {
            joined.join(a, b);
            joined.join(b, c);
        }
        let (of_vertex, count) = joined.numbered();
        let mut surfaces = Self { is_flat: vec![true; count], is_solid: vec![false; count], of_vertex };
        surfaces.find_flat(geometry, positions);
        surfaces.find_solid(geometry, positions);
        surfaces
    }

    fn find_flat(&mut self, geometry: &Geometry, positions: &[Vec3]) {
        let mut sums = vec![Vec3::ZERO; self.is_flat.len()];
        let normal_of = |corners: [u32; 3]| {
            let [a, b, c] = corners.map(|vertex| positions[vertex as usize]);
            (b - a).cross(c - a)
        };
        for &corners in &geometry.triangles {
            sums[self.of_vertex[corners[0] as usize] as usize] += normal_of(corners);
        }
        let normals: Vec<Vec3> = sums.iter().map(|sum| sum.normalize_or_zero()).collect();
        let mut bounds = vec![(Vec3::MAX, Vec3::MIN); self.is_flat.len()];
        for (vertex, &surface) in self.of_vertex.iter().enumerate() {
            let (low, high) = &mut bounds[surface as usize];
            (*low, *high) = (low.min(positions[vertex]), high.max(positions[vertex]));
        }
        for &corners in &geometry.triangles {
            let surface = self.of_vertex[corners[0] as usize] as usize;
            let normal = normals[surface];
            let own = normal_of(corners).normalize_or(normal);
            let (low, high) = bounds[surface];
            let slack = FLATNESS * (high - low).length();
            let off_plane = |vertex: u32| (positions[vertex as usize] - 0.5 * (low + high)).dot(normal).abs() > slack;
            if own.dot(normal) <= 0.0
                || own.cross(normal).length() > FLATNESS.max(1e-3)
                || corners.into_iter().any(off_plane)
            {
                self.is_flat[surface] = false;
            }
        }
        // What a skin or a morph target bends does not stay flat.
        for part in geometry.parts.iter().filter(|part| part.skin_offset.is_some() || part.morph_target_count > 0) {
            for vertex in part.vertex_offset..part.vertex_offset + part.vertex_count {
                self.is_flat[self.of_vertex[vertex as usize] as usize] = false;
            }
        }
    }

    fn find_solid(&mut self, geometry: &Geometry, positions: &[Vec3]) {
        let welded = weld(positions);
        let place = |vertex: u32| welded.group_of[vertex as usize];
        let mut joined = Disjoint::new(welded.group_count as usize);
        for &[a, b, c] in &geometry.triangles {
            joined.join(place(a), place(b));
            joined.join(place(b), place(c));
        }
        let (body_of_place, body_count) = joined.numbered();
        // Each edge of a closed mesh is walked once in each direction.
        let mut walks: HashMap<(u32, u32), i32> = HashMap::with_capacity(geometry.triangles.len() * 3 / 2);
        let mut volumes = vec![0.0f64; body_count];
        for &corners in &geometry.triangles {
            let [a, b, c] = corners.map(place);
            if a == b || b == c || c == a {
                continue;
            }
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let (key, step) = if from < to { ((from, to), 1) } else { ((to, from), 1 << 16) };
                *walks.entry(key).or_insert(0) += step;
            }
            let [a, b, c] = corners.map(|vertex| positions[vertex as usize].as_dvec3());
            volumes[body_of_place[place(corners[0]) as usize] as usize] += a.dot(b.cross(c));
        }
        let mut is_closed = vec![true; body_count];
        for ((from, _), walked) in walks {
            if walked != 1 + (1 << 16) {
                is_closed[body_of_place[from as usize] as usize] = false;
            }
        }
        for (vertex, &surface) in self.of_vertex.iter().enumerate() {
            let body = body_of_place[place(vertex as u32) as usize] as usize;
            self.is_solid[surface as usize] = is_closed[body] && volumes[body] > 0.0;
        }
    }
}

/// Sets joined two by two.
pub(super) struct Disjoint {
    parents: Vec<u32>,
}

impl Disjoint {
    pub(super) fn new(count: usize) -> Self {
        Self { parents: (0..count as u32).collect() }
    }

    fn root(&mut self, mut item: u32) -> u32 {
        while self.parents[item as usize] != item {
            // Halve the path on the way.
            let above = self.parents[self.parents[item as usize] as usize];
            self.parents[item as usize] = above;
            item = above;
        }
        item
    }

    pub(super) fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        // The lower index stays root, so that numbers follow first members.
        self.parents[a.max(b) as usize] = a.min(b);
    }

    /// Set of each item, numbered in order of first members, and their count.
    pub(super) fn numbered(mut self) -> (Vec<u32>, usize) {
        let mut numbers = vec![0u32; self.parents.len()];
        let mut count = 0;
        for item in 0..self.parents.len() as u32 {
            let root = self.root(item);
            if root == item {
                numbers[item as usize] = count;
                count += 1;
            } else {
                numbers[item as usize] = numbers[root as usize];
            }
        }
        (numbers, count as usize)
    }
}
