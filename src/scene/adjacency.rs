//! Who touches whom: one-rings, incident triangles and coincident vertices of a triangle list.
//!
//! Works on indices alone, so a method may ask for the adjacency of any index list (welded or not).

use std::collections::HashMap;

use glam::Vec3;

/// Compressed rows: row `i` is `values[offsets[i]..offsets[i + 1]]`.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Rows {
    /// `row_count + 1` entries, the first 0.
    pub offsets: Vec<u32>,
    pub values: Vec<u32>,
}

impl Rows {
    /// Rows of (row, value) pairs; values keep their order within a row. Rows must be below `row_count`.
    pub fn collect(row_count: u32, pairs: impl Iterator<Item = (u32, u32)> + Clone) -> Self {
        let mut offsets = vec![0u32; row_count as usize + 1];
        for (row, _) in pairs.clone() {
            offsets[row as usize + 1] += 1;
        }
        for row in 1..offsets.len() {
            offsets[row] += offsets[row - 1];
        }
        let mut next = offsets.clone();
        let mut values = vec![0u32; offsets[row_count as usize] as usize];
        for (row, value) in pairs {
            let slot = &mut next[row as usize];
            values[*slot as usize] = value;
            *slot += 1;
        }
        Self { offsets, values }
    }

    pub fn row(&self, index: u32) -> &[u32] {
        let index = index as usize;
        &self.values[self.offsets[index] as usize..self.offsets[index + 1] as usize]
    }

    pub fn row_count(&self) -> u32 {
        self.offsets.len().saturating_sub(1) as u32
    }
}

/// Triangles that touch each vertex, in rising order. Indices must be below `vertex_count`.
pub fn incident_triangles(vertex_count: u32, triangles: &[[u32; 3]]) -> Rows {
    let corners = triangles.iter().enumerate();
    Rows::collect(vertex_count, corners.flat_map(|(triangle, corners)| corners.map(|vertex| (vertex, triangle as u32))))
}

/// Vertices that share a triangle with each vertex, itself left out, in rising order, each once.
pub fn one_ring(vertex_count: u32, triangles: &[[u32; 3]]) -> Rows {
    let incident = incident_triangles(vertex_count, triangles);
    let mut rings = Rows { offsets: vec![0], values: Vec::with_capacity(triangles.len() * 4) };
    let mut ring = Vec::new();
    for vertex in 0..vertex_count {
        ring.clear();
        for &triangle in incident.row(vertex) {
            ring.extend(triangles[triangle as usize].into_iter().filter(|&other| other != vertex));
        }
        ring.sort_unstable();
        ring.dedup();
        rings.values.extend_from_slice(&ring);
        rings.offsets.push(rings.values.len() as u32);
    }
    rings
}

/// Group of each vertex: vertices at bit-equal positions (-0 counts as 0) share one. Groups are numbered from 0
/// in order of their first vertex. Take the rest pose's world positions for elements that stay together.
pub fn weld(positions: &[Vec3]) -> Weld {
    let mut groups: HashMap<[u32; 3], u32> = HashMap::with_capacity(positions.len());
    let group_of = positions.iter().map(|&position| {
        let next = groups.len() as u32;
        *groups.entry(position_key(position)).or_insert(next)
    });
    let group_of = group_of.collect();
    Weld { group_of, group_count: groups.len() as u32 }
}

/// See [`weld`].
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Weld {
    /// One per vertex.
    pub group_of: Vec<u32>,
    pub group_count: u32,
}

impl Weld {
    /// The vertices of each group, in rising order.
    pub fn members(&self) -> Rows {
        let vertices = self.group_of.iter().enumerate();
        Rows::collect(self.group_count, vertices.map(|(vertex, &group)| (group, vertex as u32)))
    }
}

/// Bits that are equal exactly where positions compare equal.
pub(super) fn position_key(position: Vec3) -> [u32; 3] {
    // Adding +0 turns -0 into +0 and leaves every other number alone.
    (position + Vec3::ZERO).to_array().map(f32::to_bits)
}
