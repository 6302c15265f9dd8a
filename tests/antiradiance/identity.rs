//! The identity the method stands on, G = U - U J G: what is left after antiradiance is what rays say is visible, on the
//! same elements, bins and transfers.

use crate::common::TestContext;
use crate::fixture::{Fixture, builtin_scene};
use crate::support::{prepare, settings, solve};
use crate::twins;
use glam::{EulerRot, Mat4, Quat, Vec3};
use linklight::gpu::shaders::types::Ray;
use linklight::methods::antiradiance::Settings;
use linklight::scene::{Scene, Transform};
use linklight::stages::hierarchy::NONE;
use linklight::stages::trace;

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
    let place_of = |p: u32, q: u32| p.min(q) as usize * nodes.len() + p.max(q) as usize;
    let mut ray_of = vec![NONE; nodes.len() * nodes.len()];
    let mut rays = Vec::new();
    for &(cell, entry, _) in &transfers {
        let (p, q) = (cell / m, entry / m);
        if ray_of[place_of(p, q)] == NONE {
            ray_of[place_of(p, q)] = rays.len() as u32;
            let [from, to] = [p, q].map(|node| nodes[node as usize].center);
            rays.push(Ray { origin: from, t_min: 1e-3, direction: to - from, t_max: 1.0 - 1e-3 });
        }
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
        if is_free[ray_of[place_of(p, q)] as usize] == 0 {
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

/// The scene turned about the origin: its walls then lie askew of the bins' borders.
fn turned(mut scene: Scene, turn: Quat) -> Scene {
    for node in scene.nodes.iter_mut().filter(|node| node.parent.is_none()) {
        node.transform = Transform::Matrix(Mat4::from_quat(turn) * node.transform.matrix());
    }
    scene
}

#[test]
fn what_is_left_is_what_rays_see() {
    let context = TestContext::new();
    // Leaves alone are linked: both sides of the comparison have the same transfers.
    let finest = |bins| Settings { refinement: 1e-2, undershoot: 1e9, depth: 30, tolerance: 1e-5, ..settings(bins) };
    // Which borders of bins the elements' directions fall on moves the error of one turn by some hundredths, up or down; and
    // .013 is the elements' own, one ray for each pair of them, whatever the bins.
    let turns = [Quat::IDENTITY, Quat::from_euler(EulerRot::XYZ, 0.4, 0.3, 0.2)];
    let fixtures = turns.map(|turn| Fixture::new(&context, turned(builtin_scene("cornell-box"), turn), Some(0.7)));
    let mut errors = Vec::new();
    for bins in [72, 200, 392] {
        let own = fixtures.each_ref().map(|fixture| compare(&context, fixture, finest(bins)));
        let mean = own.iter().map(|(error, _)| error).sum::<f64>() / own.len() as f64;
        println!(
            "{bins} bins: antiradiance differs from rays by {mean:.4}; by turn of the scene (error, energy) {own:.4?}"
        );
        errors.push(mean);
    }
    assert!(errors.is_sorted_by(|a, b| a > b) && errors[1] < 0.02, "{errors:?}");
    // Without antiradiance the difference is of another order: one step sees through everything.
    let blind = Settings { refinement: 1e-2, depth: 1, ..settings(128) };
    let (unoccluded, energy) = compare(&context, &fixtures[0], blind);
    println!("without antiradiance: {:.1} %, energy ratio {energy:.3}", 100.0 * unoccluded);
    assert!(unoccluded > 2.0 * errors[1] && energy > 1.0);
}
