//! How far the picture is from its limit, told by its two halves: samples of even and of odd index.

use glam::Vec3;

/// Statistical error of a picture, estimated from the picture itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorEstimate {
    pub samples: u32,
    /// Over pixels and channels, W m^-2 sr^-1.
    pub mean: f64,
    /// Standard error of one pixel's value, root mean square over pixels and channels, as a fraction of the mean.
    pub relative_pixel_error: f64,
    /// Standard error of the picture's mean, as a fraction of it.
    pub relative_mean_error: f64,
}

impl ErrorEstimate {
    /// From sums over `samples` samples of all (`total`) and of those with even index; `None` below two samples.
    pub(super) fn from_sums(total: impl ExactSizeIterator<Item = Vec3>, even: &[Vec3], samples: u32) -> Option<Self> {
        let pixels = total.len() as f64;
        if samples < 2 || pixels == 0.0 {
            return None;
        }
        let even_count = f64::from(samples.div_ceil(2));
        let odd_count = f64::from(samples / 2);
        // Var(even mean - odd mean) = variance (1 / even_count + 1 / odd_count); wanted is variance / samples.
        let share = (even_count * odd_count).sqrt() / f64::from(samples);

        let (mut sum, mut squares, mut squared_means) = (0.0, 0.0, 0.0);
        for (total, even) in total.zip(even) {
            let (total, even) = (total.as_dvec3(), even.as_dvec3());
            let error = (even / even_count - (total - even) / odd_count) * share;
            sum += total.element_sum();
            squares += error.length_squared();
            // Channels share their paths: their mean is one number of noise, pixels are independent.
            squared_means += (error.element_sum() / 3.0).powi(2);
        }
        let mean = sum / (3.0 * pixels * f64::from(samples));
        let relative = |error: f64| if mean > 0.0 { error / mean } else { 0.0 };
        Some(Self {
            samples,
            mean,
            relative_pixel_error: relative((squares / (3.0 * pixels)).sqrt()),
            relative_mean_error: relative(squared_means.sqrt() / pixels),
        })
    }
}
