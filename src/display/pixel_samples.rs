//! Where in its pixel each sample lies: a lattice whose samples, seen along x or along y alone, lie at equal distances.
//!
//! All pixels share the places (a pass draws one sample of the whole picture), so the error of an edge that runs along
//! rows or columns does not average out over its pixels: it is at most half a sample, and none in the mean over where the
//! edge may lie. A bright lamp's edge is such an edge.

use glam::Vec2;

/// Offset from the centre of a pixel of sample `index` of `count`, pixels: a rank-1 lattice.              [Dammertz2008]
/// Samples in a row are spread over the pixel, so that the first of many already cover it.
///
/// [Dammertz2008]: crate::methods::PAPERS
pub fn sample_offset(index: u32, count: u32) -> Vec2 {
    let count = u64::from(count.max(1));
    let step = generator(count);
    let along = |multiple: u64| ((multiple % count) as f64 + 0.5) / count as f64 - 0.5;
    let x = u64::from(index) * step % count;
    Vec2::new(along(x) as f32, along(x * step) as f32)
}

/// The step of the lattice {(k, k step mod count)} whose nearest points are farthest apart, of those near the golden
/// section of `count`.
fn generator(count: u64) -> u64 {
    let golden = (count as f64 * 0.618_033_988_749_895) as u64;
    let near = golden.saturating_sub(16).max(1)..=(golden + 16).min(count.max(2) - 1);
    near.filter(|&step| has_no_common_divisor(step, count)).max_by_key(|&step| shortest(step, count)).unwrap_or(1)
}

fn has_no_common_divisor(mut a: u64, mut b: u64) -> bool {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a == 1
}

/// Squared length of the shortest vector of the lattice that (1, step) and (0, count) span: Gauss' reduction.
fn shortest(step: u64, count: u64) -> i128 {
    let dot = |[a, b]: [i128; 2], [c, d]: [i128; 2]| a * c + b * d;
    let (mut short, mut long) = ([1, step as i128], [0, count as i128]);
    while dot(long, long) > dot(short, short) {
        let multiple = (dot(short, long) as f64 / dot(short, short) as f64).round() as i128;
        (short, long) = ([long[0] - multiple * short[0], long[1] - multiple * short[1]], short);
    }
    // Here `long` is the last that was shortest: what replaced it is no shorter.
    dot(long, long).min(dot(short, short))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn offsets(count: u32) -> Vec<Vec2> {
        (0..count).map(|index| sample_offset(index, count)).collect()
    }

    /// Between samples of neighbouring pixels too.
    fn nearest(offsets: &[Vec2]) -> f32 {
        let apart = |a: Vec2, b: Vec2| ((a - b) - (a - b).round()).length();
        let pairs = (0..offsets.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
        pairs.map(|(i, j)| apart(offsets[i], offsets[j])).fold(f32::MAX, f32::min)
    }

    #[test]
    fn one_sample_is_the_centre() {
        assert_eq!(offsets(1), [Vec2::ZERO]);
    }

    #[test]
    fn samples_lie_at_equal_distances_along_both_axes() {
        for count in [2, 3, 4, 8, 9, 16, 30, 64, 100, 1000] {
            for axis in 0..2 {
                let mut along: Vec<f32> = offsets(count).iter().map(|offset| offset[axis]).collect();
                along.sort_by(f32::total_cmp);
                for (index, at) in along.iter().enumerate() {
                    let expected = (index as f32 + 0.5) / count as f32 - 0.5;
                    assert!((at - expected).abs() < 1e-6, "{count} samples, axis {axis}: {at} for {expected}");
                }
            }
        }
    }

    #[test]
    fn samples_keep_their_distance() {
        for count in [4u32, 8, 9, 16, 30, 64, 100, 1000] {
            // Of points that lie as hexagons.
            let farthest = (2.0 / (3.0f32.sqrt() * count as f32)).sqrt();
            let distance = nearest(&offsets(count));
            assert!(distance > 0.6 * farthest, "{count} samples: {distance} of {farthest}");
        }
        let in_a_row: Vec<Vec2> = (0..16).map(|index| (sample_offset(0, 16) + 0.01 * index as f32).fract()).collect();
        assert!(nearest(&in_a_row) < 0.1, "a row would go unnoticed");
    }

    #[test]
    fn the_first_of_many_cover_the_pixel() {
        for count in [64, 256, 1000] {
            let first = &offsets(count)[..16];
            let mean = first.iter().sum::<Vec2>() / 16.0;
            assert!(mean.abs().max_element() < 0.1, "{count} samples: {mean}");
        }
    }

    #[test]
    fn any_count_is_served() {
        for count in (1..300).chain([65_536, u32::MAX]) {
            for index in [0, count / 2, count - 1] {
                let offset = sample_offset(index, count);
                assert!(offset.abs().max_element() <= 0.5, "{index} of {count}: {offset}");
            }
        }
    }
}
