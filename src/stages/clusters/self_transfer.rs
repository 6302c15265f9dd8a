//! What a cluster's faces send each other: of its halves, and between them. What is near in the whole is far apart in
//! some part, so that few pairs of places tell each.
//!
//! Differs from [Gobbetti2003]: there the bound 1 - A_n / A is taken (3.3.3), which most of what lies apart does not
//! come near.
//!
//! [Gobbetti2003]: crate::methods::PAPERS

use super::measure::Face;
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// Pairs of places that are looked at, at least and at most; between, as many as there are faces.
const LEAST_PAIRS: usize = 16;
const MOST_PAIRS: usize = 256;
/// Steps of an even sequence in four dimensions.                                               [Roberts2018]
const STEPS: [f64; 4] = [0.856_674_883_854_502_9, 0.733_891_856_627_126, 0.628_706_721_037_808_7, 0.538_597_257_223_61];

/// Per W/m2 that the faces' fronts send, and their backs, W that meet the same side of the cluster itself: m2.
pub type SelfTransfer = [f32; 2];

/// A place on face `share` of all.
fn place(faces: &[Face], share: f32, uv: Vec2) -> (&Face, Vec3) {
    let face = &faces[((share * faces.len() as f32) as usize).min(faces.len() - 1)];
    let uv = if uv.x + uv.y > 1.0 { 1.0 - uv } else { uv };
    let [a, b, c] = face.corners;
    (face, a + uv.x * (b - a) + uv.y * (c - a))
}

/// What two sets of faces send each other, one way, as if nothing stood between.
pub(super) fn between(left: &[Face], right: &[Face]) -> SelfTransfer {
    let count = (left.len() + right.len()).clamp(LEAST_PAIRS, MOST_PAIRS);
    let counts = [left, right].map(|faces| faces.len() as f32);
    let mut sums = [0.0f32; 2];
    for k in 0..count {
        // One after the other of one side with van der Corput's order of the other: near and far pairs alike.
        let shares = [(k as f32 + 0.5) / count as f32, (k as u32).reverse_bits() as f32 / 2f32.powi(32)];
        let [u, v, s, t] = STEPS.map(|step| (0.5 + step * k as f64).fract() as f32);
        let ((from, p), (to, q)) = (place(left, shares[0], Vec2::new(u, v)), place(right, shares[1], Vec2::new(s, t)));
        let squared = p.distance_squared(q).max(1e-30);
        let [out, back] = [from.normal.dot(q - p), to.normal.dot(p - q)];
        if out * back > 0.0 {
            let value = counts[0] * counts[1] * out * back / (PI * squared * squared);
            // No place sees more than a hemisphere.
            sums[usize::from(out < 0.0)] += value.min(counts[0] * from.area).min(counts[1] * to.area);
        }
    }
    sums.map(|sum| sum / count as f32)
}
