//! Mean structural similarity of two planes [Wang2004], with weights so that masked pixels and borders take no part.
//!
//! [Wang2004]: crate::methods::PAPERS

use rayon::prelude::*;

const RADIUS: usize = 5;
const SIGMA: f64 = 1.5;

/// Mean SSIM over the pixels of weight 1 (others have weight 0 and value 0). `range` is the L of the paper; where it
/// is 0 the reference is black, and the result is 1 if the picture is black too, else 0.
pub(super) fn mean_ssim(width: usize, a: &[f64], b: &[f64], weights: &[f64], range: f64) -> f64 {
    if range <= 0.0 {
        return if a == b { 1.0 } else { 0.0 };
    }
    let blur = |value: &(dyn Fn(usize) -> f64 + Sync)| gaussian(width, weights.len(), value);
    let weight = blur(&|i| weights[i]);
    let mean_a = blur(&|i| a[i]);
    let mean_b = blur(&|i| b[i]);
    let square_a = blur(&|i| a[i] * a[i]);
    let square_b = blur(&|i| b[i] * b[i]);
    let product = blur(&|i| a[i] * b[i]);

    let (c1, c2) = ((0.01 * range).powi(2), (0.03 * range).powi(2));
    let (mut sum, mut count) = (0.0, 0.0);
    for i in (0..weights.len()).filter(|i| weights[*i] > 0.0) {
        let (mu_a, mu_b) = (mean_a[i] / weight[i], mean_b[i] / weight[i]);
        let variance_a = (square_a[i] / weight[i] - mu_a * mu_a).max(0.0);
        let variance_b = (square_b[i] / weight[i] - mu_b * mu_b).max(0.0);
        // Rounding of the moments must not break |covariance| <= (variance_a + variance_b) / 2.
        let bound = (variance_a + variance_b) / 2.0;
        let covariance = (product[i] / weight[i] - mu_a * mu_b).clamp(-bound, bound);
        let luminance = (2.0 * mu_a * mu_b + c1) / (mu_a * mu_a + mu_b * mu_b + c1);
        let structure = (2.0 * covariance + c2) / (variance_a + variance_b + c2);
        sum += luminance * structure;
        count += 1.0;
    }
    sum / count
}

/// Separable Gaussian sums of `value(index)`; what lies outside the picture counts as zero.
fn gaussian(width: usize, length: usize, value: &(dyn Fn(usize) -> f64 + Sync)) -> Vec<f64> {
    let kernel: [f64; 2 * RADIUS + 1] =
        std::array::from_fn(|i| (-(i as f64 - RADIUS as f64).powi(2) / (2.0 * SIGMA * SIGMA)).exp());
    let height = length / width;
    let mut rows = vec![0.0; length];
    rows.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, sum) in row.iter_mut().enumerate() {
            for neighbour in x.saturating_sub(RADIUS)..(x + RADIUS + 1).min(width) {
                *sum += kernel[neighbour + RADIUS - x] * value(y * width + neighbour);
            }
        }
    });
    let mut sums = vec![0.0; length];
    sums.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for neighbour in y.saturating_sub(RADIUS)..(y + RADIUS + 1).min(height) {
            let factor = kernel[neighbour + RADIUS - y];
            for (sum, value) in row.iter_mut().zip(&rows[neighbour * width..]) {
                *sum += factor * value;
            }
        }
    });
    sums
}
