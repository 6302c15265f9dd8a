//! Both schemes: they agree, they settle, they do not grow.

use crate::common::TestContext;
use crate::fixture::{Fixture, builtin_scene};
use crate::support::{prepare, relative_rmse, settings, solve};
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

/// 300 steps on the office, whose shelves have dozens of surfaces one behind the other: both schemes settle, and in one place.
#[test]
fn the_office_settles_over_300_steps() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("office"), None);
    // Four steps of antiradiance to one of light, as in the paper.
    let base = Settings { depth: 4, tolerance: 0.0, refinement: 8.0, ..settings(72) };
    let mut light = Vec::new();
    for (name, settings) in
        [("asymmetric", base), ("symmetric", Settings { scheme: Scheme::Symmetric, iterations: 300, ..base })]
    {
        let mut method = prepare(&context, &fixture, settings);
        light.push(solve(&context, &mut method, &fixture, 75).indirect);
        let residuals: Vec<_> = method.residuals().iter().filter(|r| r.bounce > 0).collect();
        assert_eq!(residuals.len(), 300);
        let at = |step: usize| residuals[step].relative();
        println!(
            "{name}, {}, damped by {}: a step changes {:.1e} of the light at first, {:.1e} after 100, {:.1e} after 300",
            method.report(),
            method.damping(),
            at(0),
            at(99),
            at(299)
        );
        assert!(at(299) < 1e-5, "{}", at(299));
        let largest = residuals.iter().map(|r| r.total).fold(0.0, f64::max);
        assert!(largest < 3.0 * residuals[299].total, "{largest}");
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
