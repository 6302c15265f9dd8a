//! Charts grown over neighbouring triangles whose normals agree, projected along their mean normal.

use super::flat::overlapping;
use super::{Piece, Source, Surface, neighbours, place_keys};
use crate::scene::adjacency::Weld;
use glam::{Vec2, Vec3};
use std::collections::{HashMap, VecDeque};
use std::f32::consts::TAU;

/// A triangle that turns further away than this from the final mean normal leaves the chart: it would be flattened to a
/// fifth.
const LEAST_COSINE: f32 = 0.2;

/// Charts of all triangles that are not taken.
pub(super) fn pieces(surface: &Surface<'_>, weld: &Weld, max_angle: f32, is_taken: &mut [bool]) -> Vec<Piece> {
    let mut ids: HashMap<(u32, u64), u64> = HashMap::new();
    let free: Vec<u32> = (0..surface.triangles.len() as u32).filter(|&t| !is_taken[t as usize]).collect();
    let mut corner_keys = HashMap::with_capacity(free.len());
    for &triangle in &free {
        let part = surface.triangle_part[triangle as usize];
        let keys = place_keys(surface, weld, triangle).map(|place| {
            let next = ids.len() as u64;
            *ids.entry((part, place)).or_insert(next)
        });
        corner_keys.insert(triangle, keys);
    }
    let next_to = neighbours(free.iter().copied(), |t| corner_keys[&t]);
    let mut pieces = Vec::new();
    for &seed in &free {
        // Charts give back only triangles after their seed, so that one pass over the seeds takes all.
        if !is_taken[seed as usize] {
            let grown = grow(surface, &next_to, max_angle.cos(), seed, is_taken);
            pieces.push(project(surface, &next_to, grown, is_taken));
        }
    }
    pieces
}

/// Breadth first from the seed, so that charts come out compact.
fn grow(
    surface: &Surface<'_>,
    next_to: &HashMap<u32, [Option<u32>; 3]>,
    least_cosine: f32,
    seed: u32,
    is_taken: &mut [bool],
) -> Vec<u32> {
    let mut grown = vec![seed];
    let mut sum = surface.across(seed);
    let mut waiting = VecDeque::from([seed]);
    is_taken[seed as usize] = true;
    while let Some(triangle) = waiting.pop_front() {
        for other in next_to[&triangle].into_iter().flatten() {
            let across = surface.across(other);
            // A triangle without area goes with any neighbour.
            if is_taken[other as usize] || across.dot(sum) < least_cosine * across.length() * sum.length() {
                continue;
            }
            is_taken[other as usize] = true;
            sum += across;
            grown.push(other);
            waiting.push_back(other);
        }
    }
    grown
}

/// Lays the chart out; triangles that turn away from the mean or fall on others are given back.
fn project(
    surface: &Surface<'_>,
    next_to: &HashMap<u32, [Option<u32>; 3]>,
    grown: Vec<u32>,
    is_taken: &mut [bool],
) -> Piece {
    let seed = grown[0];
    let sum: Vec3 = grown.iter().map(|&t| surface.across(t)).sum();
    let faces = |normal: Vec3, triangle: u32| {
        let across = surface.across(triangle);
        across.dot(normal) >= LEAST_COSINE * across.length()
    };
    // The seed stays in any case, so that every chart has a triangle: one so small that its area is 0 faces nowhere.
    let mean = sum.try_normalize().filter(|&mean| faces(mean, seed));
    let normal = mean.or(surface.across(seed).try_normalize()).unwrap_or(Vec3::Y);
    let facing: Vec<u32> = grown.iter().copied().filter(|&t| t == seed || faces(normal, t)).collect();
    let mut is_inside: HashMap<u32, bool> = facing.iter().map(|&t| (t, true)).collect();
    let (u, v) = axes(surface, next_to, normal, &facing, &is_inside);
    let flat = |&t: &u32| surface.corners(t).map(|p| Vec2::new(p.dot(u), p.dot(v)));
    let corner_uv: Vec<[Vec2; 3]> = facing.iter().map(flat).collect();
    let mut piece = Piece { source: Source::Projected, triangles: Vec::new(), corner_uv: Vec::new() };
    for ((&triangle, uv), is_over) in facing.iter().zip(&corner_uv).zip(overlapping(&corner_uv)) {
        if is_over {
            is_inside.remove(&triangle);
        } else {
            piece.triangles.push(triangle);
            piece.corner_uv.push(*uv);
        }
    }
    for triangle in grown {
        is_taken[triangle as usize] = is_inside.contains_key(&triangle);
    }
    piece
}

/// Axes in the plane of `normal` that most of the chart's border runs along, so that rectangles lie straight.
fn axes(
    surface: &Surface<'_>,
    next_to: &HashMap<u32, [Option<u32>; 3]>,
    normal: Vec3,
    triangles: &[u32],
    is_inside: &HashMap<u32, bool>,
) -> (Vec3, Vec3) {
    let (x, y) = normal.any_orthonormal_pair();
    // Directions that differ by a quarter turn count as one.
    let mut sum = Vec2::ZERO;
    for triangle in triangles {
        let corners = surface.corners(*triangle);
        for (edge, other) in next_to[triangle].iter().enumerate() {
            if other.is_none_or(|other| !is_inside.contains_key(&other)) {
                let along = corners[(edge + 1) % 3] - corners[edge];
                let along = Vec2::new(along.dot(x), along.dot(y));
                sum += along.length() * Vec2::from_angle(4.0 * along.to_angle());
            }
        }
    }
    let angle = if sum.length_squared() > 0.0 { (sum.to_angle() / 4.0).rem_euclid(TAU / 4.0) } else { 0.0 };
    let (sin, cos) = angle.sin_cos();
    (cos * x + sin * y, cos * y - sin * x)
}
