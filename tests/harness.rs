//! The comparators themselves: each error figure is fed wrong pictures and must report them, and must be silent about
//! the right one. A comparison that cannot fail would pass every other test of this project.

use glam::Vec3;
use linklight::report::errors::{ErrorFigures, compare};
use linklight::report::image::Picture;
use linklight::report::tonemap::ToneSettings;

const SIDE: u32 = 96;

/// A room-like picture: gradients, hard edges, a bright patch, deterministic texture.
fn reference() -> Picture {
    picture(|x, y| {
        let wall = Vec3::new(0.7, 0.6, 0.5) * (0.2 + x as f32 / SIDE as f32);
        let floor = Vec3::new(0.3, 0.35, 0.4) * (1.5 - y as f32 / SIDE as f32);
        let base = if y * 3 > SIDE * 2 { floor } else { wall };
        let box_shadow = if (30..50).contains(&x) && (50..80).contains(&y) { 0.25 } else { 1.0 };
        let lamp = if (60..70).contains(&x) && (8..14).contains(&y) { 20.0 } else { 0.0 };
        base * box_shadow * (1.0 + 0.1 * noise(x, y)) + Vec3::splat(lamp)
    })
}

fn picture(value: impl Fn(u32, u32) -> Vec3) -> Picture {
    let rgb = (0..SIDE * SIDE).map(|index| value(index % SIDE, index / SIDE)).collect();
    Picture::new(SIDE, SIDE, rgb).unwrap()
}

/// -1..1, a hash of the place.
fn noise(x: u32, y: u32) -> f32 {
    let mut hash = x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca6b);
    hash = (hash ^ (hash >> 15)).wrapping_mul(0x2c1b_3c6d);
    hash = (hash ^ (hash >> 12)).wrapping_mul(0x297a_2d39);
    (hash >> 8) as f32 / (1u32 << 23) as f32 - 1.0
}

fn changed(change: impl Fn(u32, u32, Vec3) -> Vec3) -> Picture {
    let reference = reference();
    picture(|x, y| change(x, y, reference.rgb[(y * SIDE + x) as usize]))
}

fn figures(picture: &Picture) -> ErrorFigures {
    compare(picture, &reference(), None, &ToneSettings::default()).unwrap().figures
}

/// Every figure as an error: 0 is perfect, more is worse.
fn errors(picture: &Picture) -> [(&'static str, f64); 7] {
    let figures = figures(picture);
    [
        ("rmse", figures.rmse),
        ("relative MSE", figures.relative_mse.unwrap()),
        ("energy", (figures.mean_ratio.unwrap() - 1.0).abs()),
        ("relative p95", figures.relative_error_p95.unwrap()),
        ("1 - SSIM", 1.0 - figures.ssim),
        ("FLIP mean", figures.flip_mean),
        ("FLIP p95", figures.flip_p95),
    ]
}

fn error(picture: &Picture, name: &str) -> f64 {
    errors(picture).into_iter().find(|(figure, _)| *figure == name).unwrap().1
}

#[test]
fn the_right_picture_has_no_error() {
    for (name, error) in errors(&reference()) {
        assert_eq!(error, 0.0, "{name}");
    }
}

/// A picture that is wrong everywhere is reported by every figure, whichever of the two is the wrong one.
#[test]
fn every_figure_reports_a_wrong_picture() {
    let wrong = changed(|x, y, rgb| rgb * (1.3 + 0.5 * noise(y, x)));
    for (name, error) in errors(&wrong) {
        assert!(error > 0.02, "{name} is {error} for a picture that is 30 % too bright and noisy");
    }
    let tone = ToneSettings::default();
    let swapped = compare(&reference(), &wrong, None, &tone).unwrap().figures;
    assert!(swapped.rmse > 0.02 && swapped.relative_mse.unwrap() > 0.02 && swapped.mean_ratio.unwrap() < 0.98);
    assert!(swapped.relative_error_p95.unwrap() > 0.02 && swapped.ssim < 0.98);
    assert!(swapped.flip_mean > 0.02 && swapped.flip_p95 > 0.02);
}

/// Each figure sees the kind of error it is there for, and by how much.
#[test]
fn each_figure_sees_its_own_kind_of_error() {
    let dark = changed(|_, _, rgb| rgb * 0.995);
    assert!((error(&dark, "energy") - 0.005).abs() < 1e-4, "half a per cent of lost energy");

    let firefly = changed(|x, y, rgb| if (x, y) == (11, 17) { rgb + Vec3::splat(96.0) } else { rgb });
    assert!((error(&firefly, "rmse") - 1.0).abs() < 1e-4, "96 in one of 96 x 96 pixels");
    assert_eq!(error(&firefly, "relative p95"), 0.0, "one pixel is below the 95th percentile");

    let sixteenth = changed(|x, y, rgb| if x < 24 && y < 24 { rgb * 2.0 } else { rgb });
    assert!(error(&sixteenth, "relative p95") > 0.5, "6 % of the pixels are twice too bright");

    // The mean stays; only structure goes.
    let row_mean = |y: u32| {
        let row = &reference().rgb[(y * SIDE) as usize..((y + 1) * SIDE) as usize];
        row.iter().sum::<Vec3>() / SIDE as f32
    };
    let means: Vec<Vec3> = (0..SIDE).map(row_mean).collect();
    let smeared = changed(|_, y, _| means[y as usize]);
    assert!(error(&smeared, "energy") < 1e-5);
    assert!(error(&smeared, "1 - SSIM") > 0.3, "smeared rows: {}", error(&smeared, "1 - SSIM"));

    let swapped_colors = changed(|_, _, rgb| Vec3::new(rgb.z, rgb.y, rgb.x));
    assert!(error(&swapped_colors, "FLIP mean") > 0.05, "{}", error(&swapped_colors, "FLIP mean"));
}

/// Worse pictures get worse figures.
#[test]
fn figures_grow_with_the_error() {
    let noisy = |amount: f32| errors(&changed(|x, y, rgb| rgb * (1.0 + amount * (0.2 + noise(y, x)))));
    let series = [0.01, 0.05, 0.2, 0.6].map(noisy);
    for pair in series.windows(2) {
        for ((name, smaller), (_, larger)) in pair[0].iter().zip(&pair[1]) {
            assert!(larger > smaller, "{name}: {larger} after {smaller}");
        }
    }
}

/// An error in the masked half is invisible, the same error in the other half is not.
#[test]
fn a_mask_hides_only_what_it_covers() {
    let mask = picture(|x, _| if x < SIDE / 2 { Vec3::ONE } else { Vec3::ZERO });
    let tone = ToneSettings::default();
    let wrong = |left: bool| changed(|x, _, rgb| if (x < SIDE / 2) == left { rgb * 3.0 } else { rgb });
    let hidden = compare(&wrong(false), &reference(), Some(&mask), &tone).unwrap().figures;
    assert_eq!((hidden.rmse, hidden.ssim, hidden.flip_mean), (0.0, 1.0, 0.0));
    assert_eq!(hidden.pixels, (SIDE * SIDE / 2) as usize);
    let seen = compare(&wrong(true), &reference(), Some(&mask), &tone).unwrap().figures;
    assert!(seen.rmse > 0.1 && seen.ssim < 0.9 && seen.flip_mean > 0.1, "{seen:?}");
}

/// Maps mark the place of the error.
#[test]
fn maps_point_at_the_error() {
    let wrong = changed(|x, y, rgb| if (70..80).contains(&x) && (40..50).contains(&y) { rgb * 4.0 } else { rgb });
    let comparison = compare(&wrong, &reference(), None, &ToneSettings::default()).unwrap();
    let inside = (45 * SIDE + 75) as usize;
    let far = (90 * SIDE + 5) as usize;
    for map in [&comparison.flip_map, &comparison.relative_map] {
        assert_eq!(map.len(), (SIDE * SIDE) as usize);
        assert!(map[inside] > 0.2 && map[far] < 1e-3, "inside {}, far {}", map[inside], map[far]);
    }
}

/// One NaN is an error of the comparison, not a figure.
#[test]
fn a_nan_is_never_averaged() {
    let mut wrong = reference();
    wrong.rgb[500].z = f32::NAN;
    assert!(compare(&wrong, &reference(), None, &ToneSettings::default()).is_err());
}
