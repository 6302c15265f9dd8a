//! Tessellation to a bounded edge length, so that there are enough finite elements to carry the light.
//!
//! Works on world positions at rest. Every edge is cut into the fewest equal segments that are short enough: a
//! decision of the edge's end positions alone, so that edges shared by index, or coincident along a seam or between
//! two objects, are cut at the very same places (no T-junctions). New vertices are shared where the old edge was
//! and separate where it was, so smooth stays smooth and hard stays hard. The inside of each triangle is filled by
//! [`patch`]. Attributes are interpolated linearly; normals and tangents made unit again; skin influences merged to
//! the eight strongest.

mod blend;
mod build;
mod edges;
pub mod patch;

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use thiserror::Error;

use super::deform::world_positions;
use super::geometry::{Geometry, GeometryCounts, GeometryError};
use super::pose::Pose;
use edges::Edges;
use patch::{Patch, segments};

/// How fine to cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fineness {
    /// No edge longer, metres.
    MaxEdge(f32),
    /// About this many elements (vertices), never fewer than there are. Within 20 % where edge lengths vary; counts
    /// jump by up to twice where very many edges have the same length (a fine regular grid).
    Elements(u32),
    /// As [`Fineness::Elements`], but no edge longer than a share of the scene's diagonal, as long as that takes no more
    /// than about four times as many elements (as asked, or as there are): a scene of many small things has large
    /// floors too.
    Balanced { elements: u32, longest_edge: f32 },
}

#[derive(Debug, Clone, PartialEq)]
pub struct Tessellation {
    pub geometry: Geometry,
    /// World positions at rest, one per vertex. Bit-equal where vertices coincide, also between parts: for
    /// [`super::adjacency::weld`]. Deforming the vertices anew gives the same up to rounding.
    pub rest_positions: Vec<Vec3>,
    /// The edge length kept, metres.
    pub max_edge: f32,
}

#[derive(Debug, Clone, PartialEq, Error)]
pub enum TessellationError {
    #[error("maximal edge length {0}: must be above 0")]
    EdgeLength(f32),
    #[error(transparent)]
    Geometry(#[from] GeometryError),
}

/// Cuts `geometry` as fine as asked. `rest` is [`Pose::rest`] of the same scene. Input, result and working memory
/// together stay within `max_memory_bytes`.
pub fn tessellate(
    geometry: Geometry,
    rest: &Pose,
    fineness: Fineness,
    max_memory_bytes: u64,
) -> Result<Tessellation, TessellationError> {
    if let Fineness::Elements(target) = fineness
        && target <= geometry.vertex_count()
    {
        return Ok(uncut(geometry, rest));
    }
    // Adding zero turns -0 into 0: coincident positions then have the same bits.
    let positions: Vec<Vec3> = world_positions(&geometry, rest).into_iter().map(|p| p + Vec3::ZERO).collect();
    let mesh = Mesh { edges: Edges::of(&geometry.triangles, &positions), geometry, positions, max_memory_bytes };
    let max_edge = match fineness {
        Fineness::MaxEdge(length) if length > 0.0 => f64::from(length),
        Fineness::MaxEdge(length) => return Err(TessellationError::EdgeLength(length)),
        Fineness::Elements(target) => mesh.edge_length_for(target)?,
        Fineness::Balanced { elements, longest_edge } if longest_edge > 0.0 => {
            let vertices = mesh.geometry.vertex_count();
            let bound = mesh.bounded_edge_length(f64::from(longest_edge), 4.0 * f64::from(elements.max(vertices)));
            if vertices >= elements { bound } else { mesh.edge_length_for(elements)?.min(bound) }
        }
        Fineness::Balanced { longest_edge, .. } => return Err(TessellationError::EdgeLength(longest_edge)),
    };
    mesh.check(mesh.least_counts(max_edge))?;
    let counts = mesh.counts(max_edge);
    mesh.check(counts)?;
    Ok(mesh.build(max_edge, counts))
}

/// As it is; the edge length kept is that of the longest edge.
fn uncut(geometry: Geometry, rest: &Pose) -> Tessellation {
    let rest_positions = world_positions(&geometry, rest);
    let longest = geometry.triangles.iter().fold(0.0f32, |longest, corners| {
        let [a, b, c] = corners.map(|vertex| rest_positions[vertex as usize]);
        longest.max(a.distance(b)).max(b.distance(c)).max(c.distance(a))
    });
    Tessellation { geometry, rest_positions, max_edge: longest }
}

/// A geometry about to be cut.
struct Mesh {
    geometry: Geometry,
    /// World positions at rest.
    positions: Vec<Vec3>,
    edges: Edges,
    max_memory_bytes: u64,
}

impl Mesh {
    fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.geometry.triangles[triangle].map(|vertex| self.positions[vertex as usize].as_dvec3())
    }

    /// Of the box around all vertices, metres.
    fn diagonal(&self) -> f64 {
        let start = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        let [low, high] = self.positions.iter().fold(start, |[low, high], &p| [low.min(p), high.max(p)]);
        if self.positions.is_empty() { 0.0 } else { high.as_dvec3().distance(low.as_dvec3()) }
    }

    fn side_segments(&self, triangle: usize, max_edge: f64) -> [u32; 3] {
        self.edges.of_triangle[triangle].map(|edge| segments(self.edges.lengths[edge as usize], max_edge))
    }

    /// Exact counts: subdivides every triangle and counts.
    fn counts(&self, max_edge: f64) -> GeometryCounts {
        let count = |patch: &mut Patch, triangle| {
            let segments = self.side_segments(triangle, max_edge);
            if segments == [1; 3] {
                return (0, 1);
            }
            patch.subdivide(self.corners(triangle), segments, max_edge);
            (patch.interior().len() as u64, patch.triangles.len() as u64)
        };
        let triangles = 0..self.geometry.triangles.len();
        let pieces: Vec<(u64, u64)> = triangles.into_par_iter().map_init(Patch::default, count).collect();

        let mut added = vec![0u64; self.geometry.parts.len()];
        for ((interior, _), &part) in pieces.iter().zip(&self.geometry.triangle_part) {
            added[part as usize] += interior;
        }
        for (ends, &length) in self.edges.ends.iter().zip(&self.edges.lengths) {
            let part = self.geometry.vertex_part[ends[0] as usize];
            added[part as usize] += u64::from(segments(length, max_edge)) - 1;
        }
        let mut counts = self.geometry.counts();
        counts.triangles = pieces.iter().map(|(_, triangles)| triangles).sum();
        for (part, added) in self.geometry.parts.iter().zip(added) {
            counts.vertices += added;
            counts.skinned_vertices += if part.skin_offset.is_some() { added } else { 0 };
            counts.morph_deltas += added * u64::from(part.morph_target_count);
        }
        counts
    }

    /// Vertices and triangles with triangles `density` times smaller than the largest that fits. By Euler's formula
    /// a triangle with `b` vertices on its border and `i` inside is cut into `2 i + b - 2`.
    fn estimate(&self, max_edge: f64, density: f64) -> [u64; 2] {
        // No triangle with all edges that short is larger than the equilateral one.
        let largest = 3.0f64.sqrt() / 4.0 * max_edge * max_edge;
        let pieces = |index: usize| {
            let [a, b, c] = self.corners(index);
            let area = (b - a).cross(c - a).length() * 0.5;
            let border: f64 = self.side_segments(index, max_edge).into_iter().map(f64::from).sum();
            let pieces = (density * area / largest).max(border - 2.0);
            [(pieces - border + 2.0) * 0.5, pieces]
        };
        let add = |a: [f64; 2], b: [f64; 2]| [a[0] + b[0], a[1] + b[1]];
        // Fixed chunks: the sum is the same however many threads there are.
        let count = self.geometry.triangles.len();
        let chunk = |first: usize| (first..(first + CHUNK).min(count)).map(pieces).fold([0.0; 2], add);
        let chunks: Vec<[f64; 2]> = (0..count).into_par_iter().step_by(CHUNK).map(chunk).collect();
        let sums = chunks.into_iter().fold([0.0; 2], add);
        let cuts = self.edges.lengths.par_iter().map(|&length| u64::from(segments(length, max_edge)) - 1);
        let cuts: u64 = cuts.sum();
        // Conversions saturate, and so do the checks that follow.
        [(self.positions.len() as u64 + cuts).saturating_add(sums[0] as u64), sums[1] as u64]
    }

    /// Counts that no tessellation can stay below.
    fn least_counts(&self, max_edge: f64) -> GeometryCounts {
        let [vertices, triangles] = self.estimate(max_edge, 1.0);
        GeometryCounts { vertices, triangles, ..self.geometry.counts() }
    }

    /// Refuses what does not fit.
    fn check(&self, counts: GeometryCounts) -> Result<(), GeometryError> {
        let edge_bytes = size_of::<[u32; 2]>() + size_of::<f64>() + size_of::<u32>();
        let triangle_bytes = 3 * (size_of::<(u64, u32)>() + size_of::<u32>()) + size_of::<(u64, u64)>();
        let working = (self.edges.lengths.len() * edge_bytes
            + self.positions.len() * size_of::<Vec3>()
            + self.geometry.triangles.len() * triangle_bytes) as u64;
        // Positions at rest of the result, and where each of its new vertices comes from.
        let beside = counts.vertices.saturating_mul((size_of::<Vec3>() + size_of::<blend::Source>()) as u64);
        let held = self.geometry.counts().bytes().saturating_add(working).saturating_add(beside);
        counts.check_beside("the tessellated scene", held, self.max_memory_bytes)
    }

    /// The edge length that gives about `target` vertices.
    fn edge_length_for(&self, target: u32) -> Result<f64, GeometryError> {
        let longest = self.edges.lengths.iter().copied().fold(0.0, f64::max);
        let target = u64::from(target);
        if longest <= 0.0 {
            return Ok(f64::MIN_POSITIVE);
        }
        self.check(GeometryCounts { vertices: target, ..self.geometry.counts() })?;

        // The estimate is cheap and smooth; comparing it with exact counts corrects what is asked of it.
        let error = |count: u64| (count as f64 / target as f64).ln().abs();
        let mut wanted = target as f64;
        let mut best = (longest, f64::INFINITY);
        // The exact count is no smooth function of the length: the search is damped, and short where it costs much.
        for _ in 0..(10_000_000 / target).clamp(4, 12) {
            let length = self.invert_estimate(wanted, longest);
            let count = self.counts(length).vertices;
            if error(count) < best.1 {
                best = (length, error(count));
            }
            if best.1 < 0.05 {
                break;
            }
            wanted *= (target as f64 / count as f64).powf(0.7);
        }
        Ok(best.0)
    }

    /// `share` of the diagonal, or the length at which about `most` vertices are made where that is longer.
    fn bounded_edge_length(&self, share: f64, most: f64) -> f64 {
        let length = (share * self.diagonal()).max(f64::MIN_POSITIVE);
        if (self.estimate(length, TYPICAL_DENSITY)[0] as f64) <= most {
            return length;
        }
        let longest = self.edges.lengths.iter().copied().fold(0.0, f64::max);
        self.invert_estimate(most, longest)
    }

    /// The edge length at which the estimate gives `wanted` vertices, by bisection.
    fn invert_estimate(&self, wanted: f64, longest: f64) -> f64 {
        let count = |length| self.estimate(length, TYPICAL_DENSITY)[0] as f64;
        let (mut short, mut long) = (longest, longest);
        while count(short) < wanted && short > longest * 1e-9 {
            long = short;
            short *= 0.5;
        }
        for _ in 0..12 {
            let middle = (short * long).sqrt();
            if count(middle) < wanted { long = middle } else { short = middle }
        }
        (short * long).sqrt()
    }
}

/// Triangles per parallel piece of work.
const CHUNK: usize = 4096;

/// Triangles are on the mean this many times smaller than the largest that fits: 1.8 to 2.2 was measured on squares and
/// kites. A start for the search, which corrects it.
const TYPICAL_DENSITY: f64 = 2.0;
