//! Both schemes: they agree, they settle, they do not grow.

use crate::common::TestContext;
use crate::fixture::{Fixture, builtin_scene};
use crate::support::{prepare, relative_rmse, settings, solve};
use linklight::methods::antiradiance::{Scheme, Settings, growth_rate};

#[test]
fn both_schemes_agree_after_many_steps() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("cornell-box"), Some(0.9));
    for undershoot in [0.0, 0.5, 1e9] {
        let base = Settings { undershoot, refinement: 3.0, ..settings(128) };
        let symmetric = Settings { scheme: Scheme::Symmetric, iterations: 100, ..base };
        let asymmetric = Settings { scheme: Scheme::Asymmetric, depth: 40, tolerance: 1e-7, ..base };
        let light = |settings| {
            let mut method = prepare(&context, &fixture, settings);
            let indirect = solve(&context, &mut method, &fixture, 40).indirect;
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
        // Steps of half the length end in the same place; a few steps do not.
        let (damped, _) = light(Settings { damping: 0.5, iterations: 200, ..symmetric });
        assert!(relative_rmse(&damped, &other) < 1e-4, "{}", relative_rmse(&damped, &other));
        let (few, _) = light(Settings { iterations: 4, ..symmetric });
        assert!(relative_rmse(&few, &other) > 1e-3);
    }
}

/// 300 steps on the office, whose shelves have dozens of surfaces one behind the other: antiradiance settles, and stays.
#[test]
fn the_office_settles_over_300_steps() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("office"), None);
    let base = Settings { depth: 100, tolerance: 0.0, refinement: 8.0, half_tables: true, ..settings(72) };
    let mut method = prepare(&context, &fixture, base);
    println!("{}", method.report());
    solve(&context, &mut method, &fixture, 3);
    let residuals: Vec<_> = method.residuals().iter().filter(|r| r.bounce > 0).collect();
    assert_eq!(residuals.len(), 300);
    for bounce in 1..=3 {
        let own: Vec<f64> = residuals.iter().filter(|r| r.bounce == bounce).map(|r| r.relative()).collect();
        println!("bounce {bounce}: a step changes {:.1e} of the light at first, {:.1e} at last", own[0], own[99]);
        assert!(own[99] < 2e-3 && own[99] < 0.05 * own[0], "{own:?}");
    }
    let largest = residuals.iter().map(|r| r.total).fold(0.0, f64::max);
    assert!(largest < 3.0 * residuals[0].total, "{largest}");

    // The symmetric scheme too.
    let symmetric = Settings { scheme: Scheme::Symmetric, iterations: 100, ..base };
    let mut method = prepare(&context, &fixture, symmetric);
    solve(&context, &mut method, &fixture, 3);
    let residuals: Vec<_> = method.residuals().iter().filter(|r| r.bounce > 0).map(|r| r.relative()).collect();
    println!("symmetric, damped by {}: {:.1e} at first, {:.1e} at last", method.damping(), residuals[0], residuals[99]);
    assert!(residuals[99] < 2e-3, "{residuals:?}");
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
