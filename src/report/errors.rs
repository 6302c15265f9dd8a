//! How far a picture is from a reference.
//!
//! With a = picture, b = reference, over the compared pixels p (all, or those a mask keeps) and channels c:
//!
//! | figure | definition |
//! |---|---|
//! | [`rmse`](ErrorFigures::rmse) | sqrt(mean (a - b)^2), radiance units |
//! | [`relative_mse`](ErrorFigures::relative_mse) | mean of (a - b)^2 / (b^2 + e), with e = 1e-2 * (mean b)^2 |
//! | [`mean_ratio`](ErrorFigures::mean_ratio) | mean a / mean b (energy) |
//! | [`relative_error_p95`](ErrorFigures::relative_error_p95) | 95th percentile over pixels of sqrt(mean over c of (a - b)^2 / (b^2 + e)) |
//! | [`ssim`](ErrorFigures::ssim) | mean structural similarity of luminance, see [`ErrorFigures::ssim`] |
//! | [`flip_mean`](ErrorFigures::flip_mean) | mean FLIP error of the tone-mapped pictures [Andersson2020] |
//!
//! Everything is measured on linear radiance except FLIP. Sums are f64. A NaN or infinite pixel is an error with its
//! place, never part of a mean.
//!
//! [Andersson2020]: crate::methods::PAPERS

use glam::{DVec3, Vec3};
use serde::Serialize;

use super::image::{Encoding, Picture};
use super::ssim;
use super::tonemap::{ToneSettings, luminance, to_byte};

/// Weight of the squared mean of the reference in the denominators of relative errors.
pub const RELATIVE_EPSILON: f64 = 1e-2;

/// The figures of one comparison.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ErrorFigures {
    /// Pixels compared.
    pub pixels: usize,
    /// Root mean square error, W m^-2 sr^-1.
    pub rmse: f64,
    /// Relative mean square error; `None` where the reference is black and the picture is not.
    pub relative_mse: Option<f64>,
    /// Energy of the picture over energy of the reference; `None` where the reference is black and the picture is not.
    pub mean_ratio: Option<f64>,
    /// 95th percentile (nearest rank) of the per-pixel relative error; `None` as above.
    pub relative_error_p95: Option<f64>,
    /// Mean structural similarity, 1 for identical pictures [Wang2004]: Gaussian window of 11 x 11 pixels, sigma 1.5,
    /// K1 = 0.01, K2 = 0.03, on luminance.
    ///
    /// Differs from [Wang2004]: radiance has no fixed range, so L is the 95th percentile of the reference's luminance
    /// (its maximum where that is zero); windows at borders and masked pixels renormalise their weights.
    ///
    /// [Wang2004]: crate::methods::PAPERS
    pub ssim: f64,
    /// Mean FLIP error, 0..=1, at 67 pixels a degree.
    pub flip_mean: f64,
    /// 95th percentile (nearest rank) of the FLIP error.
    pub flip_p95: f64,
}

/// A comparison and the maps behind its figures, `width * height` values each; 0 where the mask leaves a pixel out.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    pub figures: ErrorFigures,
    /// FLIP error, 0..=1.
    pub flip_map: Vec<f32>,
    /// Relative error as under [`ErrorFigures::relative_error_p95`]; zero where the reference is black everywhere.
    pub relative_map: Vec<f32>,
}

/// Two pictures that cannot be compared.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CompareError {
    #[error("{what} is {found_width}x{found_height} pixels and the reference {width}x{height}; sizes must be equal")]
    Size { what: &'static str, found_width: u32, found_height: u32, width: u32, height: u32 },
    #[error(
        "the {what} holds {count} NaN or infinite pixels, the first at column {column}, row {row}; \
         error figures are defined for finite pixels only"
    )]
    NonFinite { what: &'static str, count: usize, column: usize, row: usize },
    #[error(
        "one picture is radiance (EXR, HDR) and the other is tone-mapped (PNG); compare two of a kind, \
         for instance by rendering both to .exr"
    )]
    Encoding,
    #[error("the mask is black everywhere; at least one pixel must be compared")]
    EmptyMask,
    #[error("the picture has no pixels")]
    Empty,
}

/// Compare a picture with a reference over the pixels where `mask` is not black (all of them without a mask). Both
/// pictures are tone-mapped with the values fitted to the reference for FLIP; decoded PNGs are taken as they are.
pub fn compare(
    picture: &Picture,
    reference: &Picture,
    mask: Option<&Picture>,
    tone: &ToneSettings,
) -> Result<Comparison, CompareError> {
    check_same_size("the picture", picture, reference)?;
    if let Some(mask) = mask {
        check_same_size("the mask", mask, reference)?;
    }
    if picture.encoding != reference.encoding {
        return Err(CompareError::Encoding);
    }
    if reference.rgb.is_empty() {
        return Err(CompareError::Empty);
    }
    let kept: Option<Vec<bool>> = mask.map(|mask| mask.rgb.iter().map(|value| *value != Vec3::ZERO).collect());
    let keeps = |index: usize| kept.as_ref().is_none_or(|kept| kept[index]);
    let indices: Vec<usize> = (0..reference.rgb.len()).filter(|index| keeps(*index)).collect();
    if indices.is_empty() {
        return Err(CompareError::EmptyMask);
    }
    check_finite("reference", reference, &indices)?;
    check_finite("picture", picture, &indices)?;

    let pixels = || indices.iter().map(|&index| (picture.rgb[index].as_dvec3(), reference.rgb[index].as_dvec3()));
    let sample_count = indices.len() as f64 * 3.0;
    let sum_squares: f64 = pixels().map(|(a, b)| (a - b).length_squared()).sum();
    let (sum_a, sum_b) = pixels().fold((0.0, 0.0), |(x, y), (a, b)| (x + a.element_sum(), y + b.element_sum()));

    let mut relative = relative_squares(pixels(), sum_b / sample_count);
    let mut relative_map = vec![0.0f32; reference.rgb.len()];
    for (&index, &squares) in indices.iter().zip(&relative) {
        relative_map[index] = shown_error(squares);
    }
    let relative_mse = relative.iter().sum::<f64>() / indices.len() as f64;
    let p95 = percentile(&mut relative, 0.95).sqrt();
    let mean_ratio = if sum_a == sum_b { 1.0 } else { sum_a / sum_b };
    let defined = |value: f64| value.is_finite().then_some(value);

    let (ssim, flip_map) = (ssim_of(picture, reference, &keeps), flip_of(picture, reference, &keeps, tone));
    let mut flip: Vec<f64> = indices.iter().map(|&index| f64::from(flip_map[index])).collect();
    let figures = ErrorFigures {
        pixels: indices.len(),
        rmse: (sum_squares / sample_count).sqrt(),
        relative_mse: defined(relative_mse),
        mean_ratio: defined(mean_ratio),
        relative_error_p95: defined(p95),
        ssim,
        flip_mean: flip.iter().sum::<f64>() / flip.len() as f64,
        flip_p95: percentile(&mut flip, 0.95),
    };
    Ok(Comparison { figures, flip_map, relative_map })
}

/// The relative MSE of two lists of as many pixels, and the error of each pixel as under
/// [`ErrorFigures::relative_error_p95`]; `None` where it is undefined.
pub fn relative_mse(picture: &[Vec3], reference: &[Vec3]) -> (Option<f64>, Vec<f32>) {
    let pixels = picture.iter().zip(reference).map(|(a, b)| (a.as_dvec3(), b.as_dvec3()));
    let mean = pixels.clone().map(|(_, b)| b.element_sum()).sum::<f64>() / (3 * reference.len().max(1)) as f64;
    let squares = relative_squares(pixels, mean);
    let figure = squares.iter().sum::<f64>() / squares.len().max(1) as f64;
    (figure.is_finite().then_some(figure), squares.into_iter().map(shown_error).collect())
}

/// Squared relative errors of pairs (picture, reference), means over channels; `mean` of the reference.
fn relative_squares(pixels: impl Iterator<Item = (DVec3, DVec3)>, mean: f64) -> Vec<f64> {
    let epsilon = RELATIVE_EPSILON * mean.powi(2);
    // A zero denominator is a black channel of a black picture: no error there counts as none, any as undefined.
    let relative_square = |a: f64, b: f64| if a == b { 0.0 } else { (a - b).powi(2) / (b * b + epsilon) };
    pixels.map(|(a, b)| (0..3).map(|c| relative_square(a[c], b[c])).sum::<f64>() / 3.0).collect()
}

fn shown_error(squares: f64) -> f32 {
    if squares.is_finite() { squares.sqrt() as f32 } else { 0.0 }
}

fn check_same_size(what: &'static str, picture: &Picture, reference: &Picture) -> Result<(), CompareError> {
    let (width, height) = (reference.width, reference.height);
    let (found_width, found_height) = (picture.width, picture.height);
    if (found_width, found_height) != (width, height) || picture.rgb.len() != reference.rgb.len() {
        return Err(CompareError::Size { what, found_width, found_height, width, height });
    }
    Ok(())
}

fn check_finite(what: &'static str, picture: &Picture, indices: &[usize]) -> Result<(), CompareError> {
    let mut bad = indices.iter().filter(|index| !picture.rgb[**index].is_finite());
    let Some(&first) = bad.next() else { return Ok(()) };
    let width = picture.width as usize;
    Err(CompareError::NonFinite { what, count: 1 + bad.count(), column: first % width, row: first / width })
}

/// Nearest-rank percentile of a non-empty list, which it reorders.
fn percentile(values: &mut [f64], fraction: f64) -> f64 {
    let rank = ((fraction * values.len() as f64).ceil() as usize).clamp(1, values.len());
    *values.select_nth_unstable_by(rank - 1, f64::total_cmp).1
}

fn ssim_of(picture: &Picture, reference: &Picture, keeps: &dyn Fn(usize) -> bool) -> f64 {
    let luminances = |picture: &Picture| -> Vec<f64> {
        let value = |(index, rgb): (usize, &Vec3)| if keeps(index) { f64::from(luminance(*rgb)) } else { 0.0 };
        picture.rgb.iter().enumerate().map(value).collect()
    };
    let weights: Vec<f64> = (0..reference.rgb.len()).map(|index| if keeps(index) { 1.0 } else { 0.0 }).collect();
    let (a, b) = (luminances(picture), luminances(reference));
    let mut compared: Vec<f64> = b.iter().zip(&weights).filter(|(_, weight)| **weight > 0.0).map(|(l, _)| *l).collect();
    let p95 = percentile(&mut compared, 0.95);
    let range = if p95 > 0.0 { p95 } else { compared.iter().copied().fold(0.0, f64::max) };
    ssim::mean_ssim(reference.width as usize, &a, &b, &weights, range)
}

fn flip_of(picture: &Picture, reference: &Picture, keeps: &dyn Fn(usize) -> bool, tone: &ToneSettings) -> Vec<f32> {
    let map = match reference.encoding {
        Encoding::Radiance => Some(tone.fit(&reference.rgb)),
        Encoding::Display => None,
    };
    // Pixels that are left out are black in both, so that they cannot reach their neighbours through FLIP's filters.
    let bytes = |picture: &Picture| -> Vec<u8> {
        let shown = |(index, rgb): (usize, &Vec3)| match (keeps(index), map) {
            (false, _) => [0; 3],
            (true, Some(map)) => map.apply(*rgb).to_array().map(to_byte),
            (true, None) => rgb.to_array().map(to_byte),
        };
        picture.rgb.iter().enumerate().flat_map(shown).collect()
    };
    let flip_image = |picture| nv_flip::FlipImageRgb8::with_data(reference.width, reference.height, &bytes(picture));
    let errors = nv_flip::flip(flip_image(reference), flip_image(picture), nv_flip::DEFAULT_PIXELS_PER_DEGREE);
    let mut errors = errors.to_vec();
    for (index, error) in errors.iter_mut().enumerate() {
        if !keeps(index) {
            *error = 0.0;
        }
    }
    errors
}

#[cfg(test)]
#[path = "errors_tests.rs"]
mod tests;
