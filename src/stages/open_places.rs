//! Elements that stand inside of other things, as the corners of a wall do behind its skirting, and where they look from
//! instead: the nearest place on the triangles around them that is clear of what hides them.
//!
//! What is seen of such a triangle is what lies in the open, and its light is that of its corners: theirs has to be the
//! light out there. Where two boards hide all corners of a strip of wall between them, no neighbour could tell it.
//! Decided once, at rest: a place on a triangle stays on it however the surface deforms.
//!
//! What it does not do: the backs of two-sided surfaces tell nothing, so what lies inside of such things stays there, and
//! so do elements without a place in the open, whose triangles nobody sees.

use super::elements::{BACK_SIDE, ElementTopology, NO_ELEMENT};
use super::hidden_parts::{self, HIDDEN_FROM, HiddenPartsError};
use super::trace::Tracer;
use super::work::Watch;
use crate::gpu::Context;
use crate::gpu::shaders::types::OpenPlace;
use glam::{Vec2, Vec3};
use std::cmp::Ordering;

/// Of an element that looks from its own vertex.
pub const AT_ITS_VERTEX: OpenPlace = OpenPlace { triangle: NO_ELEMENT, barycentrics: Vec2::ZERO };

/// Share of the way to the middle of the triangles around at which an element is asked whether it stands in the open.
const BESIDE: f32 = 1.0 / 64.0;
/// Triangles around a vertex that are searched, at most, and parts along each of their sides.
const TRIANGLES: usize = 8;
const SIDE: u32 = 4;
/// Elements whose places are looked at together.
const BATCH: usize = 1 << 12;

/// The surface at rest, world space, and how rays are cast at it there.
pub struct AtRest<'a> {
    pub triangles: &'a [[u32; 3]],
    pub positions: &'a [Vec3],
    pub tracer: Tracer<'a>,
    /// How far rays start off the surface, metres.
    pub ray_offset: f32,
}

/// A place on a triangle where an element might stand.
struct Candidate {
    place: OpenPlace,
    point: Vec3,
    normal: Vec3,
}

impl AtRest<'_> {
    fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|vertex| self.positions[vertex as usize])
    }

    /// Of a triangle, towards an element's side; as long as twice its area.
    fn across(&self, triangle: u32, entry: u32) -> Vec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a) * if entry & BACK_SIDE == 0 { 1.0 } else { -1.0 }
    }

    /// Just beside its vertex.
    fn stand(&self, topology: &ElementTopology, entry: u32) -> (Vec3, Vec3) {
        let vertex = entry & !BACK_SIDE;
        let (own, around) = (self.positions[vertex as usize], topology.incident.row(vertex));
        let across: Vec3 = around.iter().map(|&triangle| self.across(triangle, entry)).sum();
        let normal = across.try_normalize().unwrap_or(Vec3::Y);
        let middles = around.iter().map(|&triangle| self.corners(triangle).iter().sum::<Vec3>() / 3.0 - own);
        let inward = middles.sum::<Vec3>() / around.len().max(1) as f32;
        (own + BESIDE * (inward - normal * normal.dot(inward)), normal)
    }

    /// Of each element a point just beside its vertex, metres, and its unit normal.
    pub fn stands(&self, topology: &ElementTopology) -> (Vec<Vec3>, Vec<Vec3>) {
        topology.vertices.iter().map(|&entry| self.stand(topology, entry)).unzip()
    }

    /// Evenly over some of the triangles around an element.
    fn candidates(&self, topology: &ElementTopology, entry: u32) -> Vec<Candidate> {
        let around = topology.incident.row(entry & !BACK_SIDE);
        let searched = around.len().min(TRIANGLES);
        let of_triangle = |k: usize| {
            let triangle = around[k * around.len() / searched];
            let [a, b, c] = self.corners(triangle);
            let normal = self.across(triangle, entry).try_normalize();
            normal.into_iter().flat_map(move |normal| {
                middles_of_parts().map(move |at| Candidate {
                    place: OpenPlace { triangle, barycentrics: at },
                    point: a + at.x * (b - a) + at.y * (c - a),
                    normal,
                })
            })
        };
        (0..searched).flat_map(of_triangle).collect()
    }
}

/// Of the `SIDE^2` equal triangles that a triangle is cut into: barycentric coordinates of corners 1 and 2.
fn middles_of_parts() -> impl Iterator<Item = Vec2> {
    let upright = |x: u32, y: u32| (x + y < SIDE).then(|| Vec2::new(x as f32, y as f32) + 1.0 / 3.0);
    let turned = |x: u32, y: u32| (x + y + 1 < SIDE).then(|| Vec2::new(x as f32, y as f32) + 2.0 / 3.0);
    let cells = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y)));
    cells.flat_map(move |(x, y)| upright(x, y).into_iter().chain(turned(x, y))).map(|at| at / SIDE as f32)
}

/// The elements that stand inside of other things, in order, by what is seen from their [`AtRest::stands`].
pub fn hidden(
    context: &Context,
    at_rest: &AtRest<'_>,
    (points, normals): (&[Vec3], &[Vec3]),
    watch: &dyn Watch,
) -> Result<Vec<usize>, HiddenPartsError> {
    if at_rest.positions.iter().any(|position| !position.is_finite()) {
        return Ok(Vec::new());
    }
    let hits = hidden_parts::back_hits(context, &at_rest.tracer, (points, normals), at_rest.ray_offset, watch)?;
    Ok((0..hits.len()).filter(|&element| hits[element] >= HIDDEN_FROM).collect())
}

/// Where each element looks from; [`AT_ITS_VERTEX`] for most.
pub fn find(
    context: &Context,
    at_rest: &AtRest<'_>,
    topology: &ElementTopology,
    watch: &dyn Watch,
) -> Result<Vec<OpenPlace>, HiddenPartsError> {
    let mut places = vec![AT_ITS_VERTEX; topology.vertices.len()];
    let back_hits = |points: &[Vec3], normals: &[Vec3]| {
        hidden_parts::back_hits(context, &at_rest.tracer, (points, normals), at_rest.ray_offset, watch)
    };
    let (points, normals) = at_rest.stands(topology);
    for elements in hidden(context, at_rest, (&points, &normals), watch)?.chunks(BATCH) {
        let rows: Vec<Vec<Candidate>> =
            elements.iter().map(|&element| at_rest.candidates(topology, topology.vertices[element])).collect();
        let (points, normals): (Vec<Vec3>, Vec<Vec3>) = rows.iter().flatten().map(|c| (c.point, c.normal)).unzip();
        let mut hits = back_hits(&points, &normals)?.into_iter();
        for (&element, row) in elements.iter().zip(&rows) {
            let own = at_rest.positions[(topology.vertices[element] & !BACK_SIDE) as usize];
            let open = row.iter().zip(hits.by_ref()).filter(|(_, hits)| *hits < HIDDEN_FROM);
            // On the very border of a board half of the rays end at its back: better where none does.
            let order = |(c, hits): &(&Candidate, u32)| (*hits > 0, c.point.distance_squared(own));
            let nearer = |a: &_, b: &_| order(a).partial_cmp(&order(b)).unwrap_or(Ordering::Equal);
            if let Some((nearest, _)) = open.min_by(nearer) {
                places[element] = nearest.place;
            }
        }
    }
    Ok(places)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_fill_a_triangle_evenly() {
        let middles: Vec<Vec2> = middles_of_parts().collect();
        assert_eq!(middles.len(), (SIDE * SIDE) as usize);
        assert!(middles.iter().all(|at| at.min_element() > 0.0 && at.x + at.y < 1.0));
        let mean = middles.iter().sum::<Vec2>() / middles.len() as f32;
        assert!((mean - Vec2::splat(1.0 / 3.0)).abs().max_element() < 1e-6, "{mean}");
    }
}
