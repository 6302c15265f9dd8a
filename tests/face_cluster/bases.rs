//! The functions of the shaders against Gram-Schmidt done by numbers.

use crate::common::TestContext;
use glam::Vec2;
use linklight::gpu::shaders::probe;

const FUNCTIONS: usize = 10;

/// 1, u, v, uv, u^2, v^2, u^3, u^2 v, u v^2, v^3.                                     [Gobbetti2003 4]
fn monomials(u: f64, v: f64) -> [f64; FUNCTIONS] {
    [1.0, u, v, u * v, u * u, v * v, u * u * u, u * u * v, u * v * v, v * v * v]
}

/// Points and weights that are exact for degree 9 in each variable: 5-point Gauss.
fn gauss() -> Vec<(f64, f64, f64)> {
    let (a, b) = ((5.0 - 2.0 * (10.0f64 / 7.0).sqrt()).sqrt() / 3.0, (5.0 + 2.0 * (10.0f64 / 7.0).sqrt()).sqrt() / 3.0);
    let (wa, wb) = ((322.0 + 13.0 * 70f64.sqrt()) / 1800.0, (322.0 - 13.0 * 70f64.sqrt()) / 1800.0);
    let line = [(-b, wb), (-a, wa), (0.0, 128.0 / 450.0), (a, wa), (b, wb)].map(|(x, w)| (0.5 + 0.5 * x, w));
    line.iter().flat_map(|&(v, wv)| line.iter().map(move |&(u, wu)| (u, v, wu * wv))).collect()
}

/// Coefficients of the orthonormal functions on the monomials, by Gram-Schmidt.
fn gram_schmidt() -> [[f64; FUNCTIONS]; FUNCTIONS] {
    let points = gauss();
    let value = |c: &[f64; FUNCTIONS], u, v| monomials(u, v).iter().zip(c).map(|(m, c)| m * c).sum::<f64>();
    let product = |a: &[f64; FUNCTIONS], b: &[f64; FUNCTIONS]| -> f64 {
        points.iter().map(|&(u, v, w)| w * value(a, u, v) * value(b, u, v)).sum()
    };
    let mut basis = [[0.0; FUNCTIONS]; FUNCTIONS];
    for k in 0..FUNCTIONS {
        let mut own = [0.0; FUNCTIONS];
        own[k] = 1.0;
        for other in &basis[..k] {
            let share = product(&own, other);
            own.iter_mut().zip(other).for_each(|(c, o)| *c -= share * o);
        }
        let norm = product(&own, &own).sqrt();
        basis[k] = own.map(|c| c / norm);
    }
    basis
}

fn of_shader(context: &TestContext, points: &[Vec2]) -> Vec<f32> {
    let table = context.upload("test/points", points).unwrap();
    let values = context.buffer("test/values", points.len() * FUNCTIONS).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    let params = probe::ClusterBasisParams { point_count: points.len() as u32 };
    recorder.dispatch(&probe::ClusterBasis { points: &table, values: &values, params }, points.len());
    recorder.submit().unwrap();
    context.download(&values).unwrap()
}

#[test]
fn functions_are_those_of_gram_schmidt() {
    let context = TestContext::new();
    let points: Vec<Vec2> = (0..121).map(|i| Vec2::new((i % 11) as f32, (i / 11) as f32) / 10.0).collect();
    let found = of_shader(&context, &points);
    let coefficients = gram_schmidt();
    let mut worst = [0.0f64; FUNCTIONS];
    for (p, values) in points.iter().zip(found.chunks(FUNCTIONS)) {
        let m = monomials(f64::from(p.x), f64::from(p.y));
        for k in 0..FUNCTIONS {
            let expected: f64 = coefficients[k].iter().zip(m).map(|(c, m)| c * m).sum();
            worst[k] = worst[k].max((f64::from(values[k]) - expected).abs());
        }
    }
    assert!(worst.iter().all(|&error| error < 1e-5), "{worst:?}");
    // The comparison tells functions apart.
    assert!(coefficients[7] != coefficients[8]);
}

#[test]
fn functions_are_orthonormal() {
    let context = TestContext::new();
    let rule = gauss();
    let points: Vec<Vec2> = rule.iter().map(|&(u, v, _)| Vec2::new(u as f32, v as f32)).collect();
    let values = of_shader(&context, &points);
    for a in 0..FUNCTIONS {
        for b in 0..FUNCTIONS {
            let product: f64 = rule
                .iter()
                .zip(values.chunks(FUNCTIONS))
                .map(|(&(_, _, w), f)| w * f64::from(f[a]) * f64::from(f[b]))
                .sum();
            let expected = f64::from(u32::from(a == b));
            assert!((product - expected).abs() < 1e-5, "{a} times {b}: {product}");
        }
    }
}
