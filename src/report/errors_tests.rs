//! The figures against values worked out by hand and by other programs. `tests/harness.rs` shows that each reports a wrong picture.

use super::*;
use crate::report::tonemap::srgb_decode;

fn picture(width: u32, height: u32, value: impl Fn(u32, u32) -> Vec3) -> Picture {
    let rgb = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| value(x, y)).collect();
    Picture::new(width, height, rgb).unwrap()
}

fn figures(a: &Picture, b: &Picture) -> ErrorFigures {
    compare(a, b, None, &ToneSettings::default()).unwrap().figures
}

fn close(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-6 * expected.abs().max(1.0), "found {found}, expected {expected}");
}

#[test]
fn figures_match_their_definitions() {
    let reference = picture(2, 1, |x, _| Vec3::splat([1.0, 3.0][x as usize]));
    let changed = picture(2, 1, |x, _| Vec3::splat([1.5, 3.0][x as usize]));
    let found = figures(&changed, &reference);
    assert_eq!(found.pixels, 2);
    close(found.rmse, (0.25f64 / 2.0).sqrt());
    // mean b = 2, e = 0.04: (0.25 / 1.04 + 0) / 2.
    close(found.relative_mse.unwrap(), 0.25 / 1.04 / 2.0);
    close(found.mean_ratio.unwrap(), 4.5 / 4.0);
    close(found.relative_error_p95.unwrap(), (0.25f64 / 1.04).sqrt());
}

/// Values by NumPy 2.4, SciPy 1.17 and flip-evaluator 1.7 (NVIDIA's own): `tools/figures/error_figures.py` prints them.
#[test]
fn figures_agree_with_other_programs() {
    let base = |x: u32, y: u32| ((x * 7 + y * 13) % 17) as f32 / 8.0 + 0.25;
    let shade = |value: f32| value * Vec3::new(1.0, 0.5, 0.25);
    let reference = picture(48, 32, |x, y| shade(base(x, y)));
    let changed = picture(48, 32, |x, y| {
        let factor = 1.0 + (((x * 5 + y * 3) % 11) as f32 - 5.0) / 32.0;
        shade(base(x, y)) * factor
    });
    let found = figures(&changed, &reference);
    close(found.rmse, 0.090_955_670_983_931_65);
    close(found.relative_mse.unwrap(), 0.009_205_767_569_752_407);
    close(found.mean_ratio.unwrap(), 0.999_733_288_813_603_6);
    close(found.relative_error_p95.unwrap(), 0.155_319_973_170_175_46);
    close(found.ssim, 0.975_714_283_153_203_1);

    let of_bytes = |bytes: [u32; 3]| Vec3::from(bytes.map(|byte| srgb_decode(byte as f32 / 255.0)));
    let display = |value: &dyn Fn(u32, u32, u32) -> u32| Picture {
        encoding: Encoding::Display,
        ..picture(48, 32, |x, y| of_bytes([0, 1, 2].map(|channel| value(x, y, channel) % 256)))
    };
    let shown = |x: u32, y: u32, channel: u32| (x * 5 + y * 3 + channel * 53) % 256;
    let other = |x: u32, y: u32, channel: u32| shown(x, y, channel) + (x * 11 + y * 7 + channel * 29) % 41;
    let found = figures(&display(&other), &display(&shown));
    assert!((found.flip_mean - 0.579_260_77).abs() < 1e-3, "{}", found.flip_mean);
    assert!((found.flip_p95 - 0.972_218_4).abs() < 1e-3, "{}", found.flip_p95);
}

#[test]
fn the_95th_percentile_ignores_the_worst_twentieth() {
    let reference = picture(100, 1, |_, _| Vec3::ONE);
    let changed = |count: u32| picture(100, 1, move |x, _| Vec3::splat(if x < count { 2.0 } else { 1.0 }));
    assert_eq!(figures(&changed(5), &reference).relative_error_p95, Some(0.0));
    close(figures(&changed(6), &reference).relative_error_p95.unwrap(), (1.0f64 / 1.01).sqrt());
}

#[test]
fn ssim_of_constant_pictures_is_the_luminance_term() {
    let (a, b) = (picture(16, 16, |_, _| Vec3::splat(1.0)), picture(16, 16, |_, _| Vec3::splat(2.0)));
    let c1 = (0.01f64 * 2.0).powi(2);
    close(figures(&a, &b).ssim, (2.0 * 2.0 + c1) / (1.0 + 4.0 + c1));
}

#[test]
fn identical_pictures_have_no_error_even_when_black_or_tiny() {
    for value in [Vec3::ZERO, Vec3::new(0.2, 5.0, 0.0), Vec3::splat(1e20)] {
        for (width, height) in [(1, 1), (3, 2), (40, 30)] {
            let a = picture(width, height, |_, _| value);
            let found = figures(&a, &a);
            assert_eq!((found.rmse, found.ssim, found.flip_mean, found.flip_p95), (0.0, 1.0, 0.0, 0.0));
            assert_eq!(
                (found.relative_mse, found.mean_ratio, found.relative_error_p95),
                (Some(0.0), Some(1.0), Some(0.0))
            );
        }
    }
}

#[test]
fn a_black_reference_has_no_relative_figures() {
    let (black, lit) = (picture(4, 4, |_, _| Vec3::ZERO), picture(4, 4, |_, _| Vec3::ONE));
    let found = figures(&lit, &black);
    assert_eq!((found.relative_mse, found.mean_ratio, found.relative_error_p95), (None, None, None));
    assert_eq!((found.rmse, found.ssim), (1.0, 0.0));
}

#[test]
fn bad_pixels_are_an_error_with_their_place() {
    let good = picture(4, 3, |_, _| Vec3::ONE);
    let mut bad = good.clone();
    bad.rgb[6].y = f32::NAN;
    bad.rgb[11].x = f32::INFINITY;
    let tone = ToneSettings::default();
    let expected = |what| CompareError::NonFinite { what, count: 2, column: 2, row: 1 };
    assert_eq!(compare(&bad, &good, None, &tone).unwrap_err(), expected("picture"));
    assert_eq!(compare(&good, &bad, None, &tone).unwrap_err(), expected("reference"));
    let mask = picture(4, 3, |x, y| if y == 0 && x < 2 { Vec3::ONE } else { Vec3::ZERO });
    let figures = compare(&bad, &good, Some(&mask), &tone).unwrap().figures;
    assert_eq!((figures.pixels, figures.rmse), (2, 0.0));
}

#[test]
fn masked_pixels_change_nothing() {
    let tone = ToneSettings::default();
    let reference = picture(32, 32, |x, y| Vec3::splat(1.0 + 0.1 * (x % 3 + y % 5) as f32));
    let mask = picture(32, 32, |x, _| if x < 16 { Vec3::ONE } else { Vec3::ZERO });
    let mut wild = reference.clone();
    for (index, pixel) in wild.rgb.iter_mut().enumerate() {
        if index % 32 >= 16 {
            *pixel = Vec3::splat(50.0);
        }
    }
    let masked = compare(&wild, &reference, Some(&mask), &tone).unwrap();
    let same = compare(&reference, &reference, Some(&mask), &tone).unwrap();
    assert_eq!(masked, same);
    assert_eq!((masked.figures.ssim, masked.figures.flip_mean), (1.0, 0.0));
    assert!(compare(&wild, &reference, None, &tone).unwrap().figures.flip_mean > 0.1);
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let tone = ToneSettings::default();
    let (a, b) = (picture(4, 4, |_, _| Vec3::ONE), picture(4, 5, |_, _| Vec3::ONE));
    assert!(matches!(compare(&a, &b, None, &tone), Err(CompareError::Size { .. })));
    assert!(matches!(compare(&a, &a, Some(&b), &tone), Err(CompareError::Size { .. })));
    let black = picture(4, 4, |_, _| Vec3::ZERO);
    assert_eq!(compare(&a, &a, Some(&black), &tone), Err(CompareError::EmptyMask));
    let display = Picture { encoding: Encoding::Display, ..a.clone() };
    assert_eq!(compare(&a, &display, None, &tone), Err(CompareError::Encoding));
    let empty = Picture::default();
    assert_eq!(compare(&empty, &empty, None, &tone), Err(CompareError::Empty));
}

#[test]
fn flip_of_display_pictures_uses_their_own_bytes() {
    let display = |byte: u8| {
        let value = srgb_decode(f32::from(byte) / 255.0);
        Picture { encoding: Encoding::Display, ..picture(32, 32, |_, _| Vec3::splat(value)) }
    };
    let found = figures(&display(0), &display(255));
    assert!(found.flip_mean > 0.9, "black against white: {}", found.flip_mean);
    assert_eq!(figures(&display(100), &display(100)).flip_mean, 0.0);
}
