//! Glossy elements: what their lobes send along the links and to the eye.

use crate::common::TestContext;
use crate::common::lobe::brdf;
use crate::common::scenes::{parallelogram, scene};
use crate::fixture::{Fixture, builtin_scene, solve};
use glam::{DVec3, UVec2, Vec3};
use linklight::methods::implicit_visibility::Settings;
use linklight::scene::Material;
use linklight::scene::camera::View;
use linklight::scene::environment::Environment;
use linklight::scene::pose::Pose;
use linklight::stages::world::World;
use std::f32::consts::PI;

fn metal(color: f32, roughness: f32) -> Material {
    Material {
        base_color: Vec3::splat(color).extend(1.0),
        metallic: 1.0,
        roughness,
        double_sided: false,
        ..Material::default()
    }
}

/// The fixture with its specular lobes, which the others leave out.
pub fn glossy(context: &TestContext, mut fixture: Fixture) -> Fixture {
    let pose = Pose::rest(&fixture.scene);
    let Fixture { scene, geometry, environment, .. } = &fixture;
    fixture.world = World::new(context, scene, geometry, &pose, environment, false).unwrap();
    fixture
}

/// Share of even light that the lobe of a metal reflects, by its integral over both hemispheres.
fn reflected_of_even_light(f0: DVec3, alpha: f64) -> f64 {
    const EYES: u32 = 24;
    const SIDE: u32 = 96;
    let middle = |k: u32, count: u32| (f64::from(k) + 0.5) / f64::from(count);
    let of_eye = |eye: u32| {
        // Even steps of the squared cosine are even steps of the cosine-weighted hemisphere.
        let cosine = middle(eye, EYES).sqrt();
        let to_eye = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
        let lights = (0..SIDE * SIDE).map(|k| {
            let (squared, phi) = (middle(k / SIDE, SIDE), std::f64::consts::TAU * middle(k % SIDE, SIDE));
            let (sine, cosine) = ((1.0 - squared).sqrt(), squared.sqrt());
            brdf(f0, 1.0, alpha, DVec3::Z, to_eye, DVec3::new(sine * phi.cos(), sine * phi.sin(), cosine)).x
        });
        std::f64::consts::PI * lights.sum::<f64>() / f64::from(SIDE * SIDE)
    };
    (0..EYES).map(of_eye).sum::<f64>() / f64::from(EYES)
}

/// A closed room of metal that emits 1 everywhere. Seen from any side the lobe reflects between its albedo at grazing and
/// at normal incidence of the light around: each bounce brings that share of the one before, evenly.    [common ground]
#[test]
fn a_furnace_of_metal_keeps_the_share_that_its_lobe_reflects() {
    let context = TestContext::new();
    let mut room = builtin_scene("furnace");
    room.materials.iter_mut().for_each(|m| *m = Material { emission: m.emission, ..metal(0.5, 0.6) });
    let fixture = glossy(&context, Fixture::new(&context, room, Some(0.9)));
    let settings = Settings { bins: 8, ..Settings::default() };
    let method = fixture.linked(&context, settings);
    assert_eq!(method.report().glossy, method.report().elements);
    let mean = |bounces: u32| {
        let last = solve(&context, &method, &fixture.world, bounces).last;
        let (sum, low, high) =
            last.iter().fold((0.0, f32::MAX, 0f32), |(sum, low, high), e| (sum + e.x, low.min(e.x), high.max(e.x)));
        let mean = sum / last.len() as f32;
        println!("bounce {bounces}: mean {:.4} of pi, {low} to {high}", mean / PI);
        assert!(low > 0.93 * mean && high < 1.07 * mean, "{low} {mean} {high}");
        mean
    };
    let bounces: Vec<f32> = (0..4).map(mean).collect();
    assert!((bounces[0] / PI - 1.0).abs() < 0.01, "direct light is {}", bounces[0]);
    let expected = reflected_of_even_light(DVec3::splat(0.5), (0.36f64.powi(2) + 1.0 / 384.0).sqrt());
    println!("the lobe reflects {expected:.4}");
    for pair in bounces.windows(2) {
        let share = f64::from(pair[1] / pair[0]);
        assert!((share / expected - 1.0).abs() < 0.02, "a bounce has {share} of the one before, not {expected}");
    }
    // Without tables metal sends nothing.
    let even = fixture.linked(&context, Settings { glossy: 2.0, ..settings });
    assert!(solve(&context, &even, &fixture.world, 1).last.iter().all(|&e| e == Vec3::ZERO));
}

/// A polished plane under a sky that is bright on one side: it shows that side where it reflects it to the eye.
#[test]
fn a_polished_plane_shows_the_sky_where_it_reflects_it() {
    let context = TestContext::new();
    let plane = parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, 8, 0);
    let sky = |towards: Vec3| {
        let texels = (0..32 * 16).map(|i| {
            let map = linklight::scene::environment::EnvironmentMap {
                width: 32,
                height: 16,
                texels: Vec::new(),
                rotation: 0.0,
            };
            let at = glam::Vec2::new((i % 32) as f32 + 0.5, (i / 32) as f32 + 0.5) / glam::Vec2::new(32.0, 16.0);
            Vec3::splat(if map.direction_of(at).dot(towards) > 0.0 { 1.0 } else { 0.1 })
        });
        Environment::Map(linklight::scene::environment::EnvironmentMap {
            width: 32,
            height: 16,
            texels: texels.collect(),
            rotation: 0.0,
        })
    };
    let room = scene(vec![metal(0.9, 0.15)], vec![plane], &[]);
    // The eye looks along -z at the plane: it sees reflected what lies towards -z.
    let view = View::towards(Vec3::new(0.0, 2.0, 4.0), Vec3::ZERO, 0.8, UVec2::new(16, 16));
    let shown = |towards: Vec3| {
        let fixture = glossy(&context, Fixture::posed(&context, room.clone(), None, sky(towards), Pose::rest));
        let method = fixture.linked(&context, Settings { bins: 16, ..Settings::default() });
        let plain = solve(&context, &method, &fixture.world, 1);
        let mut recorder = context.recorder("test").unwrap();
        method.look(&mut recorder, &fixture.world, &view);
        recorder.submit().unwrap();
        let direct = context.download(method.shown_irradiance().0).unwrap();
        assert!(plain.indirect.iter().all(|&e| e == Vec3::ZERO));
        let mean = |light: &[Vec3]| light.iter().map(|e| e.x).sum::<f32>() / light.len() as f32 / PI;
        (mean(&direct), mean(&plain.direct))
    };
    let (ahead, behind) = (shown(Vec3::NEG_Z), shown(Vec3::Z));
    println!("shown {ahead:?} with the bright side ahead, {behind:?} behind");
    assert!((0.85..1.02).contains(&ahead.0) && (0.09..0.3).contains(&behind.0));
    // Even light cannot tell them apart.
    assert!((ahead.1 - behind.1).abs() < 0.03 && (0.5..0.6).contains(&ahead.1));
}
