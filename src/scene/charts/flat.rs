//! Triangles in the plane: which of them lie over each other.

use super::bounds;
use glam::{IVec2, Vec2};
use std::collections::HashMap;

/// Cells a side of the search grid, at most.
const MAX_SIDE: f32 = 1024.0;
/// Overlap this small against a triangle's size counts as touching.
const TOUCH: f32 = 1e-3;

/// Area with its sign: positive where the corners run counter-clockwise.
pub(super) fn signed_area([a, b, c]: [Vec2; 3]) -> f32 {
    0.5 * (b - a).perp_dot(c - a)
}

/// Per triangle, whether it lies over one before it that does not itself. Triangles without area never do.
pub(super) fn overlapping(triangles: &[[Vec2; 3]]) -> Vec<bool> {
    let (low, high) = bounds(triangles);
    let side = (triangles.len() as f32).sqrt().clamp(1.0, MAX_SIDE);
    let cell = ((high - low) / side).max(Vec2::splat(f32::MIN_POSITIVE));
    let cell_of = |at: Vec2| ((at - low) / cell).as_ivec2().clamp(IVec2::ZERO, IVec2::splat(side as i32));
    let mut grid: HashMap<IVec2, Vec<u32>> = HashMap::new();
    let mut is_over = vec![false; triangles.len()];
    for (index, &triangle) in triangles.iter().enumerate() {
        if signed_area(triangle) == 0.0 {
            continue;
        }
        let (first, last) = bounds(&[triangle]);
        let (first, last) = (cell_of(first), cell_of(last));
        let cells = || (first.y..=last.y).flat_map(move |y| (first.x..=last.x).map(move |x| IVec2::new(x, y)));
        let others = cells().filter_map(|at| grid.get(&at)).flatten();
        is_over[index] = others.into_iter().any(|&other| overlap(triangle, triangles[other as usize]));
        if !is_over[index] {
            cells().for_each(|at| grid.entry(at).or_default().push(index as u32));
        }
    }
    is_over
}

/// The first triangle that lies over an earlier one.
pub(super) fn first_overlapping(triangles: &[[Vec2; 3]]) -> Option<usize> {
    overlapping(triangles).iter().position(|&is_over| is_over)
}

/// Whether two triangles share more than their rims: no edge of either separates them.
fn overlap(p: [Vec2; 3], q: [Vec2; 3]) -> bool {
    let touch = TOUCH * signed_area(p).abs().min(signed_area(q).abs()).sqrt();
    let separates = |triangle: [Vec2; 3], edge: usize| {
        let axis = (triangle[(edge + 1) % 3] - triangle[edge]).perp().normalize_or_zero();
        let range = |t: [Vec2; 3]| {
            let along = t.map(|at| axis.dot(at - triangle[edge]));
            (along.into_iter().fold(f32::MAX, f32::min), along.into_iter().fold(f32::MIN, f32::max))
        };
        let ((low_p, high_p), (low_q, high_q)) = (range(p), range(q));
        high_p.min(high_q) - low_p.max(low_q) <= touch
    };
    !(0..3).any(|edge| separates(p, edge) || separates(q, edge))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(at: Vec2) -> [Vec2; 3] {
        [at, at + Vec2::X, at + Vec2::Y]
    }

    #[test]
    fn touching_is_not_overlapping() {
        let other_half = [Vec2::X, Vec2::ONE, Vec2::Y];
        assert!(!overlap(triangle(Vec2::ZERO), other_half));
        assert!(!overlap(triangle(Vec2::ZERO), triangle(Vec2::X)));
        assert!(overlap(triangle(Vec2::ZERO), triangle(Vec2::splat(0.1))));
        let tiny_inside = triangle(Vec2::ZERO).map(|at| 0.01 * at + 0.2);
        assert!(overlap(triangle(Vec2::ZERO), tiny_inside));
    }

    #[test]
    fn of_two_over_each_other_the_later_one_is_named() {
        let triangles: Vec<_> = (0..400).map(|i| triangle(Vec2::new((i % 20) as f32, (i / 20) as f32))).collect();
        assert_eq!(first_overlapping(&triangles), None);
        let mut folded = triangles.clone();
        folded.push(triangle(Vec2::new(7.3, 12.2)));
        assert_eq!(first_overlapping(&folded), Some(400));
        let is_over = overlapping(&folded);
        assert_eq!(is_over.iter().filter(|&&is_over| is_over).count(), 1);
    }
}
