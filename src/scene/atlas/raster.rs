//! Charts into texels: every texel whose square a triangle touches, with the part of the triangle inside it.

use glam::{UVec2, Vec2};

/// The part of a triangle inside one texel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Covered {
    pub texel: UVec2,
    /// Of the texel's square, 0..1.
    pub share: f32,
    /// Centroid of the part.
    pub centre: Vec2,
    /// Mean of the squared coordinates over the part, from the texel's corner.
    pub squares: Vec2,
}

/// Calls `found` for each texel that the triangle (texel units, any winding) covers a part of.
pub(super) fn cover(triangle: [Vec2; 3], mut found: impl FnMut(Covered)) {
    let low = triangle.iter().copied().fold(Vec2::MAX, Vec2::min).floor().max(Vec2::ZERO).as_uvec2();
    let high = triangle.iter().copied().fold(Vec2::MIN, Vec2::max).ceil().max(Vec2::ZERO).as_uvec2();
    let mut polygon = Vec::with_capacity(8);
    let mut clipped = Vec::with_capacity(8);
    for y in low.y..high.y {
        for x in low.x..high.x {
            let corner = UVec2::new(x, y).as_vec2();
            polygon.clear();
            polygon.extend(triangle.map(|p| p - corner));
            for (axis, bound, sign) in [(0, 0.0, 1.0), (0, 1.0, -1.0), (1, 0.0, 1.0), (1, 1.0, -1.0)] {
                clip(&polygon, &mut clipped, |p| sign * (p[axis] - bound));
                std::mem::swap(&mut polygon, &mut clipped);
            }
            let (area, centre, squares) = moments(&polygon);
            if area > 0.0 {
                found(Covered { texel: UVec2::new(x, y), share: area, centre: corner + centre, squares });
            }
        }
    }
}

/// Keeps what lies where `height` is not negative.
fn clip(polygon: &[Vec2], kept: &mut Vec<Vec2>, height: impl Fn(Vec2) -> f32) {
    kept.clear();
    for (k, &b) in polygon.iter().enumerate() {
        let a = polygon[(k + polygon.len() - 1) % polygon.len()];
        let (height_a, height_b) = (height(a), height(b));
        if (height_a >= 0.0) != (height_b >= 0.0) {
            kept.push(a.lerp(b, height_a / (height_a - height_b)));
        }
        if height_b >= 0.0 {
            kept.push(b);
        }
    }
}

/// Unsigned area, centroid, and mean squared coordinates of a convex polygon.
fn moments(polygon: &[Vec2]) -> (f32, Vec2, Vec2) {
    let Some((&first, rest)) = polygon.split_first() else { return (0.0, Vec2::ZERO, Vec2::ZERO) };
    let (mut area, mut centre, mut squares) = (0.0, Vec2::ZERO, Vec2::ZERO);
    for pair in rest.windows(2) {
        let part = 0.5 * (pair[0] - first).perp_dot(pair[1] - first);
        let sum = first + pair[0] + pair[1];
        area += part;
        centre += part * sum / 3.0;
        squares += part * (first * first + pair[0] * pair[0] + pair[1] * pair[1] + sum * sum) / 12.0;
    }
    if area == 0.0 { (0.0, first, first * first) } else { (area.abs(), centre / area, squares / area) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_add_up_to_the_triangle() {
        let triangles = [
            [Vec2::new(0.3, 0.2), Vec2::new(7.9, 1.1), Vec2::new(2.2, 6.5)],
            [Vec2::new(5.0, 5.0), Vec2::new(1.0, 5.0), Vec2::new(5.0, 1.0)],
            [Vec2::new(2.25, 2.25), Vec2::new(2.5, 2.25), Vec2::new(2.25, 2.75)],
        ];
        for [a, b, c] in triangles {
            let (mut area, mut moment, mut second) = (0.0, Vec2::ZERO, Vec2::ZERO);
            cover([a, b, c], |part| {
                assert!(part.share <= 1.0 + 1e-5);
                assert!((part.centre - part.texel.as_vec2() - 0.5).abs().max_element() <= 0.5 + 1e-5);
                area += part.share;
                moment += part.share * part.centre;
                let corner = part.texel.as_vec2();
                second += part.share * (part.squares + corner * (2.0 * part.centre - corner));
            });
            let expected = 0.5 * (b - a).perp_dot(c - a).abs();
            assert!((area - expected).abs() < 1e-4 * expected, "{area} for {expected}");
            let sum = a + b + c;
            assert!((moment / area).distance(sum / 3.0) < 1e-4);
            let squares = (a * a + b * b + c * c + sum * sum) / 12.0;
            assert!((second / area).distance(squares) < 1e-3, "{} for {squares}", second / area);
        }
        cover([Vec2::ONE; 3], |part| panic!("a point covers nothing: {part:?}"));
    }
}
