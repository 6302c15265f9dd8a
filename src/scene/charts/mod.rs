//! Charts: pieces of the surface laid flat, each without folds or overlaps, in metres.
//!
//! A connected piece of the model's own texture coordinates is taken where it can serve: every triangle the same way
//! round, no two over each other, no part blown up against the rest (`model`). Everything else is cut anew: charts
//! grow over neighbouring triangles whose normals agree and are projected along their mean normal (`grow`).
//!
//! Two users: surface hierarchies order their leaves along a chart ([`Charts::vertex_uv`]), and atlases place texels on
//! it ([`Charts::corner_uv`]). It packs nothing: charts lie one over the other, each at its own origin.

mod flat;
mod grow;
mod model;

use super::adjacency::{self, Weld};
use super::geometry::Geometry;
use flat::first_overlapping;
use glam::{Vec2, Vec3};
use std::collections::HashMap;

/// "No chart": of a vertex that no triangle touches.
pub const NO_CHART: u32 = u32::MAX;

/// How charts are found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Take the model's own texture coordinates where they can serve.
    pub model_uv: bool,
    /// Largest angle between a triangle's normal and the mean of its grown chart, radians; below 80 degrees.
    pub max_angle: f32,
}

impl Default for Options {
    fn default() -> Self {
        Self { model_uv: true, max_angle: 45f32.to_radians() }
    }
}

/// A triangle list in the pose that the charts are measured in.
#[derive(Debug, Clone, Copy)]
pub struct Surface<'a> {
    /// Metres; bit-equal where vertices stand at one place.
    pub positions: &'a [Vec3],
    pub triangles: &'a [[u32; 3]],
    /// Charts stay within a part. One per triangle.
    pub triangle_part: &'a [u32],
    /// Texture coordinates, one set after the other in order of preference, one entry per vertex.
    pub uv: [&'a [Vec2]; 2],
}

impl<'a> Surface<'a> {
    /// The surface of a geometry whose vertices stand at `positions`. The second set, often made for light maps, is
    /// preferred.
    pub fn of(geometry: &'a Geometry, positions: &'a [Vec3]) -> Self {
        Self {
            positions,
            triangles: &geometry.triangles,
            triangle_part: &geometry.triangle_part,
            uv: [&geometry.uv[1], &geometry.uv[0]],
        }
    }

    fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|v| self.positions[v as usize])
    }

    /// Twice the area times the normal, m2.
    fn across(&self, triangle: u32) -> Vec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a)
    }
}

/// Where a chart's layout comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    Model,
    Projected,
}

/// One chart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chart {
    pub part: u32,
    pub source: Source,
    /// Its coordinates fill 0..size, metres.
    pub size: Vec2,
    /// Of its triangles in space, m2.
    pub area: f32,
}

/// All charts of a surface. Charts are numbered in order of their first triangle.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Charts {
    pub charts: Vec<Chart>,
    /// Chart of each triangle.
    pub triangle_chart: Vec<u32>,
    /// Place of each triangle's corners in its chart, metres; counter-clockwise, as the triangle is seen from its front.
    pub corner_uv: Vec<[Vec2; 3]>,
    /// The chart that most of the area around each vertex lies in, or [`NO_CHART`].
    pub vertex_chart: Vec<u32>,
    /// Place of each vertex in that chart, metres.
    pub vertex_uv: Vec<Vec2>,
}

/// A set of triangles with their layout, not yet numbered.
struct Piece {
    source: Source,
    /// In the order they were found.
    triangles: Vec<u32>,
    /// Metres, any origin.
    corner_uv: Vec<[Vec2; 3]>,
}

/// Cuts `surface` into charts. The same surface gives the same charts. Every triangle gets one; indices must be in range.
pub fn unwrap(surface: &Surface<'_>, options: &Options) -> Charts {
    let weld = adjacency::weld(surface.positions);
    let mut pieces = Vec::new();
    let mut is_taken = vec![false; surface.triangles.len()];
    if options.model_uv {
        for uv in surface.uv {
            pieces.extend(model::pieces(surface, &weld, uv, &mut is_taken));
        }
    }
    pieces.extend(grow::pieces(surface, &weld, options.max_angle.clamp(0.0, 1.4), &mut is_taken));
    number(surface, pieces)
}

/// Pieces in order of their first triangle, moved to the origin.
fn number(surface: &Surface<'_>, mut pieces: Vec<Piece>) -> Charts {
    pieces.sort_by_key(|piece| piece.triangles.iter().min().copied());
    let mut charts = Charts {
        charts: Vec::with_capacity(pieces.len()),
        triangle_chart: vec![NO_CHART; surface.triangles.len()],
        corner_uv: vec![[Vec2::ZERO; 3]; surface.triangles.len()],
        vertex_chart: vec![NO_CHART; surface.positions.len()],
        vertex_uv: vec![Vec2::ZERO; surface.positions.len()],
    };
    for (chart, piece) in pieces.iter().enumerate() {
        let (low, high) = bounds(&piece.corner_uv);
        let area = piece.triangles.iter().map(|&t| 0.5 * surface.across(t).length()).sum();
        let part = surface.triangle_part[piece.triangles[0] as usize];
        charts.charts.push(Chart { part, source: piece.source, size: high - low, area });
        for (&triangle, uv) in piece.triangles.iter().zip(&piece.corner_uv) {
            charts.triangle_chart[triangle as usize] = chart as u32;
            charts.corner_uv[triangle as usize] = uv.map(|uv| uv - low);
        }
    }
    place_vertices(surface, &mut charts);
    charts
}

/// Each vertex goes where most of the area around it lies; the first chart of equals.
fn place_vertices(surface: &Surface<'_>, charts: &mut Charts) {
    let incident = adjacency::incident_triangles(surface.positions.len() as u32, surface.triangles);
    let mut shares: Vec<(u32, f32, Vec2)> = Vec::new();
    for vertex in 0..surface.positions.len() as u32 {
        shares.clear();
        for &triangle in incident.row(vertex) {
            let chart = charts.triangle_chart[triangle as usize];
            let corner = surface.triangles[triangle as usize].iter().position(|&v| v == vertex).unwrap_or(0);
            let area = surface.across(triangle).length();
            match shares.iter_mut().find(|share| share.0 == chart) {
                Some(share) => share.1 += area,
                None => shares.push((chart, area, charts.corner_uv[triangle as usize][corner])),
            }
        }
        let best = shares.iter().copied().reduce(|best, next| {
            let is_better = next.1 > best.1 || (next.1 == best.1 && next.0 < best.0);
            if is_better { next } else { best }
        });
        if let Some((chart, _, uv)) = best {
            charts.vertex_chart[vertex as usize] = chart;
            charts.vertex_uv[vertex as usize] = uv;
        }
    }
}

fn bounds(uv: &[[Vec2; 3]]) -> (Vec2, Vec2) {
    let corners = uv.iter().flatten().copied();
    corners.fold((Vec2::MAX, Vec2::MIN), |(low, high), at| (low.min(at), high.max(at)))
}

/// Triangles across each edge of each triangle: edge `k` runs from corner `k` to the next. `None` at borders, at edges of
/// more than two triangles, and where the neighbour is wound the other way round.
fn neighbours(
    triangles: impl Iterator<Item = u32>,
    corner_keys: impl Fn(u32) -> [u64; 3],
) -> HashMap<u32, [Option<u32>; 3]> {
    let mut edges: HashMap<(u64, u64), Vec<(u32, usize)>> = HashMap::new();
    let mut all: HashMap<u32, [Option<u32>; 3]> = HashMap::new();
    for triangle in triangles {
        all.insert(triangle, [None; 3]);
        let keys = corner_keys(triangle);
        for edge in 0..3 {
            let (from, to) = (keys[edge], keys[(edge + 1) % 3]);
            edges.entry((from, to)).or_default().push((triangle, edge));
        }
    }
    let across = |(from, to): (u64, u64)| match (edges.get(&(from, to)), edges.get(&(to, from))) {
        (Some(own), Some(other)) if own.len() == 1 && other.len() == 1 && own[0].0 != other[0].0 => Some(other[0].0),
        _ => None,
    };
    for (&key, users) in &edges {
        for &(triangle, edge) in users {
            if let Some(entry) = all.get_mut(&triangle) {
                entry[edge] = across(key);
            }
        }
    }
    all
}

fn place_keys(surface: &Surface<'_>, weld: &Weld, triangle: u32) -> [u64; 3] {
    surface.triangles[triangle as usize].map(|v| u64::from(weld.group_of[v as usize]))
}

#[cfg(test)]
mod tests;
