//! The identity the method stands on, G = U - U J G: what is left after antiradiance is what rays say is visible, on the
//! same elements, bins and transfers.

use crate::common::TestContext;
use crate::fixture::{Fixture, builtin_scene};
use crate::support::{prepare, settings, solve};
use crate::twins;
use glam::Vec3;
use linklight::gpu::shaders::types::Ray;
use linklight::methods::antiradiance::Settings;
use linklight::stages::hierarchy::NONE;
use linklight::stages::trace;
use std::collections::HashMap;

/// Irradiance of one bounce by antiradiance, and by the same transfers with ray-cast visibility; relative L1 difference
/// and ratio of the sums.
fn compare(context: &TestContext, fixture: &Fixture, settings: Settings) -> (f64, f64) {
    let mut method = prepare(context, fixture, settings);
    solve(context, &mut method, fixture, 1);
    let bins = &method.bins().bins;
    let m = bins.count();
    let nodes = context.download(&method.hierarchy().nodes).unwrap();
    let leaves = context.download(&method.hierarchy().leaves).unwrap();
    let norms = context.download(&method.tables().cosine_norms).unwrap();
    let source = context.download(&method.tables().source).unwrap();
    let found = context.download(&method.tables().irradiance).unwrap();
    let transfers = method.transfers().download(context).unwrap();
    assert!(transfers.iter().all(|t| nodes[(t.0 / m) as usize].leaf != NONE && nodes[(t.1 / m) as usize].leaf != NONE));

    // A ray for each pair of leaves between which anything passes.
    let mut ray_of = HashMap::new();
    let mut rays = Vec::new();
    for &(cell, entry, _) in &transfers {
        let pair = (cell / m, entry / m);
        ray_of.entry((pair.0.min(pair.1), pair.0.max(pair.1))).or_insert_with(|| {
            let [from, to] = [pair.0, pair.1].map(|node| nodes[node as usize].center);
            rays.push(Ray { origin: from, t_min: 1e-3, direction: to - from, t_max: 1.0 - 1e-3 });
            rays.len() - 1
        });
    }
    let device_rays = context.upload("test/rays", &rays).unwrap();
    let is_free = context.buffer::<u32>("test/is free", rays.len()).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    trace::any_hit(&mut recorder, &fixture.stage().tracer, &device_rays, &is_free, rays.len());
    recorder.submit().unwrap();
    let is_free = context.download(&is_free).unwrap();

    let mut expected = vec![Vec3::ZERO; 2 * leaves.len()];
    for &(cell, entry, weight) in &transfers {
        let (p, q) = (cell / m, entry / m);
        if is_free[ray_of[&(p.min(q), p.max(q))]] == 0 {
            continue;
        }
        let (p_leaf, q_leaf) = (nodes[p as usize].leaf as usize, nodes[q as usize].leaf as usize);
        let (arriving, leaving) = (bins.directions[(cell % m) as usize], bins.directions[(entry % m) as usize]);
        let (p_cos, q_cos) = (leaves[p_leaf].normal.dot(arriving), leaves[q_leaf].normal.dot(leaving));
        let sent = source[2 * q_leaf + usize::from(q_cos <= 0.0)] / std::f32::consts::PI
            * twins::discrete_cosine(q_cos, norms[q_leaf], m);
        let received = bins.solid_angle() * twins::discrete_cosine(p_cos, norms[p_leaf], m) * weight * sent;
        expected[2 * p_leaf + usize::from(p_cos > 0.0)] += received;
    }
    let (mut error, mut sum, mut total) = (0.0, 0.0, 0.0);
    for (leaf, own) in leaves.iter().enumerate() {
        // Fronts alone: backs of one-sided surfaces reflect nothing, and their irradiance is not kept.
        let (f, e) = (found[2 * leaf], expected[2 * leaf]);
        error += f64::from(own.area * (f - e).abs().element_sum());
        sum += f64::from(own.area * f.element_sum());
        total += f64::from(own.area * e.element_sum());
    }
    (error / total, sum / total)
}

#[test]
fn what_is_left_is_what_rays_see() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("cornell-box"), Some(0.7));
    let mut errors = Vec::new();
    for bins in [72, 128, 968] {
        // Leaves alone are linked: both sides of the comparison have the same transfers.
        let settings = Settings { refinement: 1e-2, undershoot: 1e9, depth: 30, tolerance: 1e-5, ..settings(bins) };
        let (error, energy) = compare(&context, &fixture, settings);
        println!("{bins} bins: antiradiance differs from rays by {:.2} %, energy ratio {energy:.4}", 100.0 * error);
        errors.push(error);
    }
    assert!(errors.is_sorted_by(|a, b| a > b) && errors[1] < 0.02, "{errors:?}");
    // Without antiradiance the difference is of another order: one step sees through everything.
    let (unoccluded, energy) = compare(&context, &fixture, Settings { refinement: 1e-2, depth: 1, ..settings(128) });
    println!("without antiradiance: {:.1} %, energy ratio {energy:.3}", 100.0 * unoccluded);
    assert!(unoccluded > 2.0 * errors[1] && energy > 1.0);
}
