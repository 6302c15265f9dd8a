//! Both schemes: they agree, they settle, they do not grow.

use crate::common::TestContext;
use crate::fixture::{Fixture, builtin_scene};
use crate::support::{prepare, relative_rmse, settings, solve};
use crate::twins;
use glam::{DVec3, Vec3};
use linklight::methods::antiradiance::{Scheme, Settings, growth_rate};

#[test]
fn both_schemes_agree_after_many_steps() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("cornell-box"), Some(1.2));
    for undershoot in [0.5, 1e9] {
        let base = Settings { undershoot, refinement: 3.0, ..settings(128) };
        let symmetric = Settings { scheme: Scheme::Symmetric, iterations: 100, ..base };
        let asymmetric = Settings { scheme: Scheme::Asymmetric, depth: 20, tolerance: 1e-7, ..base };
        let light = |settings| {
            let mut method = prepare(&context, &fixture, settings);
            let indirect = solve(&context, &mut method, &fixture, 30).indirect;
            (indirect, method.residuals().to_vec())
        };
        let (one, residuals) = light(symmetric);
        let (other, _) = light(asymmetric);
        let difference = relative_rmse(&one, &other);
        println!("undershoot {undershoot}: the schemes differ by {difference:.2e} after many steps");
        assert!(difference < 1e-4, "{difference}");
        let last = residuals.last().unwrap();
        assert!(last.relative() < 1e-5, "{last:?}");
        assert!(growth_rate(&residuals[..20]).unwrap() < 1.0);
        if undershoot > 1.0 {
            continue;
        }
        // Steps of half the length end in the same place; a few steps do not.
        let (damped, _) = light(Settings { damping: 0.5, iterations: 200, ..symmetric });
        assert!(relative_rmse(&damped, &other) < 1e-4, "{}", relative_rmse(&damped, &other));
        let (few, _) = light(Settings { iterations: 4, ..symmetric });
        assert!(relative_rmse(&few, &other) > 1e-3);
    }
}

/// Steps of the symmetric scheme are not bounces: what was reflected last has crossed all walls, since no antiradiance of it is
/// under way yet. Where the maze is dark, two steps have many times the light of two bounces, though not of all bounces. That is
/// the method's own: the same steps in plain loops have the same light.                            [Dachsbacher2007 Fig. 2]
#[test]
fn the_last_bounce_of_symmetric_steps_crosses_walls() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("maze"), None);
    let base = Settings { scheme: Scheme::Symmetric, refinement: 6.0, undershoot: 1e9, ..settings(72) };
    let exact = Settings { scheme: Scheme::Asymmetric, depth: 12, ..base };
    let of_bounces = [2, 4].map(|bounces| {
        let mut method = prepare(&context, &fixture, exact);
        solve(&context, &mut method, &fixture, bounces);
        context.download(&method.tables().irradiance).unwrap()
    });
    let mut by_steps = Vec::new();
    for iterations in [2, 4, 8, 30] {
        let mut method = prepare(&context, &fixture, Settings { iterations, ..base });
        solve(&context, &mut method, &fixture, iterations);
        let (tables, m) = (method.tables(), method.bins().bins.count());
        let leaves = context.download(&method.hierarchy().leaves).unwrap();
        let found = context.download(&tables.irradiance).unwrap();
        by_steps.push(found.clone());
        if iterations > 4 {
            continue;
        }
        let nodes = context.download(&method.hierarchy().nodes).unwrap();
        let [norms, scales] = [&tables.cosine_norms, &tables.scales].map(|b| context.download(b).unwrap());
        let [source, albedo] = [&tables.source, &tables.albedo].map(|b| context.download(b).unwrap());
        let means = context.download(&tables.means).unwrap();
        let transfers = method.transfers().download(&context).unwrap();
        let mut sent = vec![Vec3::ZERO; nodes.len() * m as usize];
        let mut irradiance = vec![Vec3::ZERO; 2 * leaves.len()];
        // From darkness: the first pass sends the sources alone.
        for _ in 0..=iterations {
            let incident = twins::gather_and_push(&nodes, m, &transfers, &sent);
            let mut exitant = vec![DVec3::ZERO; sent.len()];
            for (k, leaf) in leaves.iter().enumerate() {
                let row = leaf.node as usize * m as usize..(leaf.node as usize + 1) * m as usize;
                let own = (
                    [source[2 * k], source[2 * k + 1]],
                    [albedo[2 * k], albedo[2 * k + 1]],
                    [scales[2 * k], scales[2 * k + 1]],
                );
                // What received nothing at first is cut at zero later.
                let lowest = |side: usize, _| {
                    Vec3::select(means[2 * k + side].cmpgt(Vec3::ZERO), Vec3::splat(-f32::MAX), Vec3::ZERO)
                };
                let twin = twins::local(leaf, norms[k], &method.bins().bins, &incident[row.clone()], own, lowest);
                exitant[row].copy_from_slice(&twin.exitant);
                (irradiance[2 * k], irradiance[2 * k + 1]) =
                    (twin.irradiance[0].as_vec3(), twin.irradiance[1].as_vec3());
            }
            twins::pull(&nodes, m, &mut exitant);
            sent = exitant.iter().map(|e| e.as_vec3()).collect();
        }
        let difference = relative_rmse(&found, &irradiance);
        println!("{iterations} steps, {}: off the twin's light by {difference:.1e}", method.report());
        assert!(difference < 1e-4, "{difference}");
    }
    // The half of the leaves that receive the least in the end.
    let last = &by_steps[3];
    let mut darkest: Vec<usize> = (0..last.len() / 2).map(|leaf| 2 * leaf).collect();
    darkest.sort_by(|&a, &b| last[a].element_sum().total_cmp(&last[b].element_sum()));
    darkest.truncate(darkest.len() / 2);
    let light =
        |irradiance: &[Vec3]| darkest.iter().map(|&side| f64::from(irradiance[side].element_sum())).sum::<f64>();
    let steps = [0, 1, 2].map(|k| light(&by_steps[k]) / light(last));
    let bounces = [0, 1].map(|k| light(&of_bounces[k]) / light(last));
    println!("where the maze is dark, of the light of 30 steps: 2, 4, 8 steps {steps:.3?}; 2, 4 bounces {bounces:.3?}");
    assert!(steps[0] > 2.0 * bounces[0] && (steps[2] - 1.0).abs() < 0.05, "{steps:?}, {bounces:?}");
}

/// The office, whose shelves have dozens of surfaces one behind the other: both schemes settle, and in one place.
/// `cargo bench --bench antiradiance` goes on for 300 steps.
#[test]
fn the_office_settles_over_many_steps() {
    const STEPS: u32 = 160;
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("office"), None);
    // Four steps of antiradiance to one of light, as in the paper.
    let base = Settings { depth: 4, tolerance: 0.0, refinement: 8.0, ..settings(72) };
    let mut light = Vec::new();
    for (name, settings) in
        [("asymmetric", base), ("symmetric", Settings { scheme: Scheme::Symmetric, iterations: STEPS, ..base })]
    {
        let mut method = prepare(&context, &fixture, settings);
        light.push(solve(&context, &mut method, &fixture, STEPS / 4).indirect);
        let residuals: Vec<_> = method.residuals().iter().filter(|r| r.bounce > 0).collect();
        assert_eq!(residuals.len(), STEPS as usize);
        let last = STEPS as usize - 1;
        let at = |step: usize| residuals[step].relative();
        println!(
            "{name}, {}, damped by {}: a step changes {:.1e} of the light at first, {:.1e} after 60, {:.1e} after {STEPS}",
            method.report(),
            method.damping(),
            at(0),
            at(59),
            at(last)
        );
        assert!(at(last) < 1e-5, "{}", at(last));
        let largest = residuals.iter().map(|r| r.total).fold(0.0, f64::max);
        assert!(largest < 3.0 * residuals[last].total, "{largest}");
    }
    let difference = relative_rmse(&light[0], &light[1]);
    println!("the schemes differ by {difference:.2e}");
    assert!(difference < 1e-4, "{difference}");
}

/// The f16 tables' error, as the settings say.
#[test]
fn half_tables_cost_little() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("cornell-box"), Some(0.6));
    let light = |half_tables| {
        let mut method = prepare(&context, &fixture, Settings { half_tables, refinement: 3.0, ..settings(200) });
        (solve(&context, &mut method, &fixture, 4).indirect, method.report().table_bytes)
    };
    let ((full, full_bytes), (half, half_bytes)) = (light(false), light(true));
    let difference = relative_rmse(&half, &full);
    println!("f16 tables: {half_bytes} of {full_bytes} bytes, light off by {difference:.2e}");
    assert_eq!(2 * half_bytes, full_bytes);
    assert!(difference > 0.0 && difference < 1e-3, "{difference}");
}
