//! The smallest rectangle around points of the plane: rotating callipers on their convex hull.   [Toussaint1983]
//!
//! [Toussaint1983]: crate::methods::PAPERS

use glam::Vec2;

/// Unit direction of the long or short side of the rectangle of least area around `points`; ties go to the first edge.
pub fn direction(points: &mut Vec<Vec2>) -> Vec2 {
    let hull = convex_hull(points);
    let mut best = (f32::INFINITY, Vec2::X);
    for (k, &p) in hull.iter().enumerate() {
        let Some(along) = (hull[(k + 1) % hull.len()] - p).try_normalize() else { continue };
        let extent = |axis: Vec2| {
            let (low, high) = hull.iter().fold((f32::MAX, f32::MIN), |(low, high), q| {
                let d = q.dot(axis);
                (low.min(d), high.max(d))
            });
            high - low
        };
        let area = extent(along) * extent(along.perp());
        if area < best.0 {
            best = (area, along);
        }
    }
    best.1
}

/// Corners of the convex hull, counter-clockwise: the monotone chain. [Andrew1979]
///
/// [Andrew1979]: crate::methods::PAPERS
pub fn convex_hull(points: &mut Vec<Vec2>) -> Vec<Vec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points.clone();
    }
    let mut hull: Vec<Vec2> = Vec::with_capacity(points.len());
    let half = |hull: &mut Vec<Vec2>, points: &mut dyn Iterator<Item = Vec2>| {
        let first = hull.len();
        for p in points {
            while hull.len() >= first + 2 {
                let (a, b) = (hull[hull.len() - 2], hull[hull.len() - 1]);
                if (b - a).perp_dot(p - a) > 0.0 {
                    break;
                }
                hull.pop();
            }
            hull.push(p);
        }
        // The last corner begins the other half.
        hull.pop();
    };
    half(&mut hull, &mut points.iter().copied());
    half(&mut hull, &mut points.iter().rev().copied());
    hull
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_rectangle_is_found() {
        for angle in [0.0f32, 0.3, 1.1, 2.5] {
            let (x, y) = (Vec2::from_angle(angle), Vec2::from_angle(angle).perp());
            let mut points: Vec<Vec2> = Vec::new();
            for i in 0..7 {
                for j in 0..4 {
                    points.push(x * i as f32 + y * j as f32);
                }
            }
            let found = direction(&mut points);
            assert!(found.dot(x).abs().max(found.dot(y).abs()) > 1.0 - 1e-5, "{angle}: {found}");
            assert!(convex_hull(&mut points).len() <= 8);
        }
    }

    #[test]
    fn few_and_equal_points_are_no_trouble() {
        for points in [vec![], vec![Vec2::ONE], vec![Vec2::ONE; 5], vec![Vec2::ZERO, Vec2::new(3.0, 4.0)]] {
            let found = direction(&mut points.clone());
            assert!((found.length() - 1.0).abs() < 1e-6, "{points:?}: {found}");
        }
    }
}
