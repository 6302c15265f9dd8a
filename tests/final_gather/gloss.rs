//! What a glossy floor reflects of walls that touch it, against the integral over its lobe.

use crate::common::TestContext;
use crate::common::lobe::brdf;
use crate::common::scenes::{lambert, parallelogram, scene};
use crate::fixture::{Fixture, Gather, view};
use glam::{DVec3, Vec3};
use linklight::display::final_gather::{Settings, Visibility};
use linklight::gpu::shaders::types::SenderLeaf;
use linklight::scene::Material;
use linklight::scene::environment::Environment;
use std::f64::consts::{PI, TAU};

const EYE: Vec3 = Vec3::new(0.2, 0.9, 1.2);
/// Of the wall and of the ceiling, W m^-2 sr^-1.
const RADIANCE: [f64; 2] = [1.0, 0.2];

/// A metal floor in front of a wall of coarse leaves that stands on it, under a ceiling.
fn fixture(context: &TestContext, roughness: f32) -> Fixture {
    let metal = Material { metallic: 1.0, roughness, double_sided: false, ..lambert(Vec3::ONE) };
    let floor = parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, 2, 0);
    let wall = parallelogram(Vec3::new(-2.0, 0.0, -2.0), Vec3::X * 4.0, Vec3::Y * 2.0, 4, 0);
    let ceiling = parallelogram(Vec3::new(-2.0, 2.0, -2.0), Vec3::X * 4.0, Vec3::Z * 4.0, 4, 0);
    let view = view(EYE, Vec3::new(0.0, 0.05, -1.8), 0.15);
    Fixture::new(context, &scene(vec![metal], vec![floor, wall, ceiling], &[]), &Environment::default(), false, view)
}

/// Radiance towards the eye from a point of the floor: over directions about the lobe, evenly drawn by its microfacets.
fn reflected(point: DVec3, roughness: f64) -> f64 {
    const SIDE: u32 = 96;
    let alpha = roughness * roughness;
    let eye = (EYE.as_dvec3() - point).normalize();
    let mut sum = 0.0;
    for k in 0..SIDE * SIDE {
        let [u, v] = [k % SIDE, k / SIDE].map(|i| (f64::from(i) + 0.5) / f64::from(SIDE));
        // Microfacet normals by D cos: density alpha^2 / (pi (cos^2 (alpha^2 - 1) + 1)^2) cos.
        let cosine = ((1.0 - u) / (u * (alpha * alpha - 1.0) + 1.0)).sqrt();
        let (sine, phi) = ((1.0 - cosine * cosine).sqrt(), TAU * v);
        let half = DVec3::new(sine * phi.cos(), cosine, sine * phi.sin());
        let light = 2.0 * eye.dot(half) * half - eye;
        let d = (alpha / (cosine * cosine * (alpha * alpha - 1.0) + 1.0)).powi(2) / PI;
        let density = d * cosine / (4.0 * eye.dot(half));
        if light.y <= 0.0 || eye.dot(half) <= 0.0 {
            continue;
        }
        let radiance = RADIANCE
            .into_iter()
            .zip([(DVec3::new(0.0, 0.0, -2.0), DVec3::Z), (DVec3::new(0.0, 2.0, 0.0), DVec3::NEG_Y)]);
        let seen = radiance.filter_map(|(radiance, (on, facing))| {
            let along = (on - point).dot(facing) / light.dot(facing);
            let hit = point + along * light;
            let is_in = hit.x.abs() <= 2.0 && hit.z.abs() <= 2.0001 && hit.y <= 2.0001;
            (light.dot(facing) < 0.0 && is_in).then_some(radiance)
        });
        sum += brdf(DVec3::ONE, 1.0, alpha, DVec3::Y, eye, light).x * light.y / density * seen.sum::<f64>();
    }
    sum / f64::from(SIDE * SIDE)
}

/// Mean over the floor's pixels of the gather and of the integral, the RMS difference as a share, and the most that a pixel
/// is above its integral.
fn against_integral(gather: &Gather, roughness: f64) -> [f64; 3] {
    let (mut sum, mut expected, mut squares, mut above, mut count) = (0.0, 0.0, 0.0, 0.0f64, 0.0);
    let on_floor = |pixel: &usize| pixel.is_multiple_of(3) && gather.normals[*pixel].y > 0.5;
    for pixel in (0..gather.normals.len()).filter(on_floor) {
        let value = f64::from(gather.direct[pixel].x);
        let integral = reflected(gather.positions[pixel].as_dvec3(), roughness);
        (sum, expected, count) = (sum + value, expected + integral, count + 1.0);
        squares += (value - integral).powi(2);
        above = above.max(value - integral);
    }
    assert!(count > 100.0, "{count} pixels");
    [sum / expected, (squares / count).sqrt() / (expected / count), above]
}

#[test]
fn leaves_that_touch_a_glossy_floor_are_reflected_as_their_lobe_asks() {
    let context = TestContext::new();
    for roughness in [0.3, 0.5] {
        let mut fixture = fixture(&context, roughness);
        let radiance = |leaf: &SenderLeaf| match leaf.centre {
            centre if centre.z < -1.999 => RADIANCE[0],
            centre if centre.y > 1.999 => RADIANCE[1],
            _ => 0.0,
        };
        let emitted: Vec<Vec3> = fixture.leaves.iter().map(|leaf| Vec3::splat((PI * radiance(leaf)) as f32)).collect();
        let dark = vec![Vec3::ZERO; emitted.len()];
        let settings = Settings {
            gather_threshold: 0.0,
            gather_visibility: Visibility::None,
            gather_jitter: true,
            ..Settings::default()
        };
        let mut gather = fixture.gather(&context, settings, &emitted, &dark, 1);
        for seed in 1..32 {
            fixture.seed = seed;
            let another = fixture.gather(&context, settings, &emitted, &dark, 1);
            let sums = gather.direct.iter_mut().zip(&another.direct);
            sums.for_each(|(mean, value)| *mean += (value - *mean) / (seed + 1) as f32);
        }
        let roughness = f64::from(roughness);
        let [energy, off, above] = against_integral(&gather, roughness);
        let [_, other, _] = against_integral(&gather, 2.0 * roughness);
        println!(
            "roughness {roughness}: energy {energy:.4}, off by {off:.4}, at most {above:.3} too bright; {other:.3} from a rougher one"
        );
        assert!((energy - 1.0).abs() < 0.02, "{energy}");
        // A pixel's estimate stays within what the lobe can reflect: a bright dot would be many times the wall's radiance.
        assert!(off < 0.15 && above < 0.5, "{off} {above}");
        assert!(other > 1.5 * off, "a wrong lobe would go unnoticed: {other}");
    }
}
