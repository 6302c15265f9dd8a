//! Form factors of facing plates: errors fall as rays and elements grow.

use crate::common::TestContext;
use crate::fixture::{Fixture, builtin_scene, solve};
use linklight::methods::explicit_visibility::{RayCount, Settings};
use linklight::stages::emitters::EmitterChoice;

/// Mean irradiance of the receiver (albedo 1) from an emitter of radiosity 1: the form factor between the plates.
fn form_factor(context: &TestContext, name: &str, max_edge: f32, settings: Settings) -> f64 {
    let fixture = Fixture::new(context, builtin_scene(name), Some(max_edge));
    let method = fixture.prepare(context, settings);
    let solution = solve(context, &method, &fixture.world, 0);
    let albedo = context.download(&method.elements().albedo).unwrap();
    let area = context.download(&method.elements().area).unwrap();
    let (mut power, mut total) = (0.0, 0.0);
    for ((albedo, area), irradiance) in albedo.iter().zip(&area).zip(&solution.direct) {
        if albedo.x > 0.5 {
            power += f64::from(area * irradiance.x);
            total += f64::from(*area);
        }
    }
    assert!((total - 1.0).abs() < 1e-5, "the receiver is a unit square, {total}");
    power / total
}

const PLATES: [(&str, f64); 2] = [("parallel-plates", 0.199_825), ("perpendicular-plates", 0.200_044)];

fn settings(emitters: EmitterChoice, rays: u32, samples: u32) -> Settings {
    let rays_per_element = RayCount::new(rays).unwrap();
    Settings { emitters, rays_per_element, emitter_samples: samples, ..Settings::default() }
}

/// Slope of log error over log refinement, by least squares.
fn order(steps: &[(f64, f64)]) -> f64 {
    let logs: Vec<(f64, f64)> = steps.iter().map(|(n, e)| (n.ln(), e.ln())).collect();
    let mean = |f: fn(&(f64, f64)) -> f64| logs.iter().map(f).sum::<f64>() / logs.len() as f64;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let covariance: f64 = logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    -covariance / logs.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>()
}

#[test]
fn linked_errors_fall_with_rays() {
    let context = TestContext::new();
    for (name, exact) in PLATES {
        let mut steps = Vec::new();
        for rays in [16, 64, 256, 1024] {
            let found = form_factor(&context, name, 1.0 / 16.0, settings(EmitterChoice::Linked, rays, 1));
            let error = (found / exact - 1.0).abs();
            println!("{name}, linked, edges 1/16, {rays} rays: {found:.6}, error {:.3} %", 100.0 * error);
            steps.push((f64::from(rays), error));
        }
        println!("{name}: error falls as rays^-{:.2}", order(&steps));
        assert!(order(&steps) > 0.3, "{name}: {steps:?}");
        assert!(steps[3].1 < 1e-2, "{name}: {steps:?}");
    }
}

#[test]
fn linked_errors_fall_with_elements() {
    let context = TestContext::new();
    for (name, exact) in PLATES {
        let mut steps = Vec::new();
        for cells in [2, 4, 8, 16] {
            let found = form_factor(&context, name, 1.0 / cells as f32, settings(EmitterChoice::Linked, 1024, 1));
            let error = (found / exact - 1.0).abs();
            println!("{name}, linked, edges 1/{cells}, 1024 rays: {found:.6}, error {:.3} %", 100.0 * error);
            steps.push((f64::from(cells), error));
        }
        println!("{name}: error falls as edge^{:.2}", order(&steps));
        assert!(steps[3].1 < steps[0].1 / 4.0, "{name}: {steps:?}");
    }
}

#[test]
fn sampled_errors_fall_with_samples() {
    let context = TestContext::new();
    for (name, exact) in PLATES {
        let mut steps = Vec::new();
        for samples in [4, 16, 64, 256] {
            let found = form_factor(&context, name, 1.0 / 16.0, settings(EmitterChoice::Sampled, 16, samples));
            let error = (found / exact - 1.0).abs();
            println!("{name}, sampled, edges 1/16, {samples} samples: {found:.6}, error {:.3} %", 100.0 * error);
            steps.push((f64::from(samples), error));
        }
        println!("{name}: error falls as samples^-{:.2}", order(&steps));
        // Along the shared edge a sample stands nearer than its own size: slower there.
        assert!(order(&steps) > 0.3, "{name}: {steps:?}");
    }
}
