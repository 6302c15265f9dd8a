//! Closed forms: furnace, form factors, energy.

use crate::render::{Set, mean, options};
use glam::{UVec2, Vec3};
use linklight::methods::path_tracing::LightSampling;
use std::f32::consts::PI;

#[test]
fn the_furnace_fills_by_the_geometric_series() {
    let set = Set::builtin("furnace");
    let view = set.view(None, UVec2::splat(16));
    for bounces in 0..=8 {
        // Reflected rays find the same radiance everywhere: no noise hides an error.
        let mut options = options(16, bounces);
        options.settings.light_sampling = LightSampling::Reflection;
        let rendered = set.render(&view, options, 16);
        let expected = 2.0 - 0.5f32.powi(bounces as i32 + 1);
        let found = mean(&rendered.radiance());
        println!("{bounces} bounces: {found}, expected {expected}");
        assert!(
            (found - expected).abs().max_element() < 2.5e-4 * expected,
            "{bounces} bounces: {found} for {expected}"
        );
    }
}

/// The receiving plate has albedo 1, the sending one radiosity 1: the receiver's mean radiosity is the form factor.
#[test]
fn form_factors_of_squares_are_the_closed_ones() {
    for (name, height, form_factor) in [("parallel-plates", 0.5, 0.199_825), ("perpendicular-plates", 2.0, 0.200_044)] {
        let set = Set::builtin(name);
        let rendered = set.render(&set.view(Some("receiver"), UVec2::splat(32)), options(32, 0), 128);
        let found = PI * mean(&rendered.direct);
        println!("{name}: {found}, expected {form_factor}, {:?}", rendered.estimate);
        assert!((found - form_factor).abs().max_element() < 1e-3, "{name}: {found} for {form_factor}");
        // The error estimate is of the size of the error.
        let estimate = rendered.estimate.unwrap();
        let error = f64::from(found.x / form_factor - 1.0).abs();
        assert!(estimate.relative_mean_error < 5e-3 && error < 5.0 * estimate.relative_mean_error, "{estimate:?}");
        // An orthographic camera straight above a plane: everything about it is known.
        assert!(rendered.depth.iter().all(|depth| (depth - height).abs() < 1e-5));
        assert!(rendered.normal.iter().all(|normal| (*normal - Vec3::Y).length() < 1e-5));
        assert!(rendered.albedo.iter().all(|&albedo| albedo == Vec3::ONE));
    }
}
