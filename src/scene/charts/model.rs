//! Charts from the model's own texture coordinates.

use super::{Piece, Source, Surface, first_overlapping, flat, neighbours};
use crate::scene::adjacency::Weld;
use glam::Vec2;
use std::collections::HashMap;

/// Area in the plane against area in space may differ by this factor from the chart's mean.
const MAX_STRETCH: f32 = 8.0;

/// Connected pieces of one set of coordinates that can serve as charts; their triangles are marked as taken.
pub(super) fn pieces(surface: &Surface<'_>, weld: &Weld, uv: &[Vec2], is_taken: &mut [bool]) -> Vec<Piece> {
    if uv.len() != surface.positions.len() {
        return Vec::new();
    }
    let mut pieces = Vec::new();
    for component in components(surface, weld, uv, is_taken) {
        if let Some(piece) = usable(surface, uv, component) {
            piece.triangles.iter().for_each(|&triangle| is_taken[triangle as usize] = true);
            pieces.push(piece);
        }
    }
    pieces
}

/// Triangles of one part connected by edges that are the same in space and in texture space.
fn components(surface: &Surface<'_>, weld: &Weld, uv: &[Vec2], is_taken: &[bool]) -> Vec<Vec<u32>> {
    let mut corner_ids: HashMap<(u32, u32, [u32; 2]), u64> = HashMap::new();
    let mut corner_of = Vec::with_capacity(surface.triangles.len());
    for (triangle, corners) in surface.triangles.iter().enumerate() {
        let part = surface.triangle_part[triangle];
        corner_of.push(corners.map(|v| {
            let at = uv[v as usize] + Vec2::ZERO;
            let next = corner_ids.len() as u64;
            *corner_ids.entry((part, weld.group_of[v as usize], at.to_array().map(f32::to_bits))).or_insert(next)
        }));
    }
    let free = (0..surface.triangles.len() as u32).filter(|&t| !is_taken[t as usize]);
    let next_to = neighbours(free.clone(), |t| corner_of[t as usize]);
    let mut is_seen = is_taken.to_vec();
    let mut components = Vec::new();
    for seed in free {
        if std::mem::replace(&mut is_seen[seed as usize], true) {
            continue;
        }
        let mut component = vec![seed];
        let mut at = 0;
        while let Some(&triangle) = component.get(at) {
            for other in next_to[&triangle].into_iter().flatten() {
                if !std::mem::replace(&mut is_seen[other as usize], true) {
                    component.push(other);
                }
            }
            at += 1;
        }
        components.push(component);
    }
    components
}

/// The component scaled to metres, or nothing where it folds, overlaps or stretches too far.
fn usable(surface: &Surface<'_>, uv: &[Vec2], triangles: Vec<u32>) -> Option<Piece> {
    let uv_of = |t: u32| surface.triangles[t as usize].map(|v| uv[v as usize]);
    // Metres per unit of u and of v, as the mean over the area: |dP/du|^2 and |dP/dv|^2.
    let (mut squared, mut area, mut orientation) = (Vec2::ZERO, 0.0, 0.0);
    for &triangle in &triangles {
        let [a, b, c] = uv_of(triangle);
        let (e1, e2) = (b - a, c - a);
        let det = e1.perp_dot(e2);
        let weight = surface.across(triangle).length();
        if weight == 0.0 {
            continue;
        }
        if !det.is_finite() || det == 0.0 || det * orientation < 0.0 {
            return None;
        }
        orientation = det.signum();
        let [p, q, r] = surface.corners(triangle);
        let du = ((q - p) * e2.y - (r - p) * e1.y) / det;
        let dv = ((r - p) * e1.x - (q - p) * e2.x) / det;
        squared += weight * Vec2::new(du.length_squared(), dv.length_squared());
        area += weight;
    }
    if area == 0.0 {
        return None;
    }
    let mut scale = Vec2::new((squared.x / area).sqrt(), (squared.y / area).sqrt());
    if !scale.is_finite() || scale.min_element() <= 0.0 {
        return None;
    }
    // Mirrored coordinates are turned round, so that corners run counter-clockwise.
    scale.x *= orientation;
    let corner_uv: Vec<[Vec2; 3]> = triangles.iter().map(|&t| uv_of(t).map(|at| at * scale)).collect();
    let is_even = |(&triangle, &uv): (&u32, &[Vec2; 3])| {
        let (flat, space) = (flat::signed_area(uv), 0.5 * surface.across(triangle).length());
        space == 0.0 || (flat <= MAX_STRETCH * space && space <= MAX_STRETCH * flat)
    };
    let serves = triangles.iter().zip(&corner_uv).all(is_even) && first_overlapping(&corner_uv).is_none();
    serves.then_some(Piece { source: Source::Model, triangles, corner_uv })
}
