//! The gather against the sum over all leaves, the furnace, shadows, its own bounds.

use crate::common::TestContext;
use crate::common::scenes::{lambert, parallelogram, scene};
use crate::fixture::{Fixture, Gather, view};
use crate::twins;
use glam::{DVec3, Vec3};
use linklight::display::final_gather::{Settings, Shows, Visibility};
use linklight::scene::environment::Environment;
use linklight::scene::{LoadOptions, Material, Scene, builtin};
use linklight::stages::sender_tree::NodeLayout;
use std::f32::consts::PI;

const ALBEDO: f32 = 0.6;

fn one_sided(albedo: f32) -> Material {
    Material { double_sided: false, ..lambert(Vec3::splat(albedo)) }
}

/// A floor in front of a wall that stands on it, under a coarse ceiling: senders that touch, near and far ones.
fn corner() -> Scene {
    let floor = parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, 9, 0);
    let wall = parallelogram(Vec3::new(-2.0, 0.0, -2.0), Vec3::X * 4.0, Vec3::Y * 2.0, 11, 0);
    let ceiling = parallelogram(Vec3::new(-2.0, 2.0, -2.0), Vec3::X * 4.0, Vec3::Z * 4.0, 3, 0);
    scene(vec![one_sided(ALBEDO)], vec![floor, wall, ceiling], &[])
}

fn corner_fixture(context: &TestContext) -> (Fixture, Vec<Vec3>, Vec<Vec3>) {
    let view = view(Vec3::new(0.3, 1.2, 3.5), Vec3::new(0.0, 0.7, -1.0), 0.6);
    let fixture = Fixture::new(context, &corner(), &Environment::default(), true, view);
    let value = |i: usize, k: usize| ((i * 37 + k * 11) % 29) as f32 / 29.0;
    let count = fixture.leaves.len();
    let values = |seed: usize| -> Vec<Vec3> {
        (0..count).map(|i| Vec3::new(value(i, seed), value(i, seed + 1), value(i, seed + 2))).collect()
    };
    (fixture, values(1), values(5))
}

/// Of the picture: relative RMS difference of the indirect light from the all-leaves sum.
fn error(fixture: &Fixture, gather: &Gather, reflected: &[Vec3]) -> f64 {
    let (mut error, mut sum) = (0.0, 0.0);
    for (pixel, &normal) in gather.normals.iter().enumerate().filter(|(_, normal)| normal.length() > 0.5) {
        let point = gather.positions[pixel].as_dvec3();
        let irradiance = twins::irradiance(point, normal.as_dvec3(), &fixture.leaves, reflected);
        let expected = irradiance * f64::from(ALBEDO / PI);
        error += gather.indirect[pixel].as_dvec3().distance_squared(expected);
        sum += expected.length_squared();
    }
    (error / sum).sqrt()
}

const ALL_SEEN: Settings = Settings {
    gather_threshold: 0.0,
    gather_chance: 0.0,
    gather_visibility: Visibility::None,
    gather_map_reach: 0.0,
    gather_map_stretch: 0.0,
    gather_jitter: false,
    gather_clamp: 0.0,
    environment_samples: 1,
    representative: linklight::stages::sender_tree::Representative::Intensity,
    gather_shows: Shows::Light,
    node_layout: NodeLayout::Wide,
    normal_weight: 0.25,
};

#[test]
fn without_a_threshold_it_is_the_sum_over_all_leaves() {
    let context = TestContext::new();
    let (fixture, emitted, reflected) = corner_fixture(&context);
    let gather = fixture.gather(&context, ALL_SEEN, &emitted, &reflected, 1);
    let off = error(&fixture, &gather, &reflected);
    println!("{}; off by {off:.2e}", gather.report);
    assert!(off < 4e-3, "points stand for polygons farther than five radii: {off}");
    assert!(gather.report.lost == Vec3::ZERO);
    // Emitted light goes to the direct part by the same kernel.
    let swapped = fixture.gather(&context, ALL_SEEN, &reflected, &emitted, 1);
    let apart = swapped.direct.iter().zip(&gather.indirect).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
    assert!(apart < 1e-6, "{apart}");
    assert!(error(&fixture, &swapped, &reflected) > 0.1, "swapped light would go unnoticed");
}

#[test]
fn errors_and_cuts_follow_the_threshold() {
    let context = TestContext::new();
    let (fixture, emitted, reflected) = corner_fixture(&context);
    for jitter in [false, true] {
        let mut before = (0.0, f64::MAX);
        for threshold in [0.0, 0.01, 0.04, 0.16, 0.64] {
            let settings = Settings { gather_threshold: threshold, gather_jitter: jitter, ..ALL_SEEN };
            let gather = fixture.gather(&context, settings, &emitted, &reflected, 1);
            let off = error(&fixture, &gather, &reflected);
            println!("threshold {threshold}, jitter {jitter}: off by {off:.4}; {}", gather.report);
            assert!(gather.report.mean_cut <= before.1, "fewer nodes at larger thresholds");
            // Statistically: a step may gain a little by luck.
            assert!(off > 0.8 * before.0, "{off} after {}", before.0);
            before = (off, gather.report.mean_cut);
        }
        assert!(before.0 > 0.01 && before.1 < 60.0, "{before:?}");
    }
}

/// Drawing leaves by chance, and asking small ones by chance, is right in the mean, whatever the threshold.
#[test]
fn what_is_drawn_is_right_in_the_mean() {
    let context = TestContext::new();
    let (mut fixture, emitted, reflected) = corner_fixture(&context);
    let mut first_errors = Vec::new();
    for gather_chance in [0.0, 2.0] {
        let settings = Settings { gather_threshold: 0.3, gather_jitter: true, gather_chance, ..ALL_SEEN };
        let mut mean: Option<Gather> = None;
        let mut errors = Vec::new();
        for seed in 0..16 {
            fixture.seed = seed;
            let gather = fixture.gather(&context, settings, &emitted, &reflected, 1);
            let so_far = match mean.take() {
                None => gather,
                Some(mut so_far) => {
                    for (sum, value) in so_far.indirect.iter_mut().zip(&gather.indirect) {
                        *sum += (value - *sum) / (seed + 1) as f32;
                    }
                    so_far
                }
            };
            errors.push(error(&fixture, &so_far, &reflected));
            mean = Some(so_far);
        }
        println!("chance {gather_chance}: errors of the mean of 1 .. 16 pictures: {errors:.4?}");
        // A quarter, give or take.
        assert!(errors[15] < 0.35 * errors[0], "{errors:?}");
        first_errors.push(errors[0]);
    }
    assert!(first_errors[1] > 1.1 * first_errors[0], "nothing was asked by chance: {first_errors:?}");
}

/// Chance spares rays: fewer are cast for a little more noise, and the light in the mean is the same.
#[test]
fn chance_spares_rays() {
    let context = TestContext::new();
    let (fixture, emitted, reflected) = corner_fixture(&context);
    let run = |gather_chance| {
        let settings = Settings {
            gather_threshold: 0.05,
            gather_jitter: true,
            gather_visibility: Visibility::Rays,
            gather_chance,
            ..ALL_SEEN
        };
        let gather = fixture.gather(&context, settings, &emitted, &reflected, 4);
        let off = error(&fixture, &gather, &reflected);
        println!("chance {gather_chance}: off by {off:.4}; {}", gather.report);
        let light = gather.indirect.iter().map(|v| v.as_dvec3().element_sum()).sum::<f64>();
        (gather.report, light, off)
    };
    let [(all, light, off), (some, some_light, some_off)] = [0.0, 1.0].map(run);
    assert!(some.mean_rays < 0.6 * all.mean_rays && some.mean_rays > 1.0, "{some}");
    // Three standard errors of the noise of 900 pixels.
    assert!((some_light / light - 1.0).abs() < 0.04, "{some_light} for {light}");
    assert!(some_off < 3.0 * off, "{some_off} for {off}");
}

/// The paper's 16 bytes a node: bounds are rounded outwards, so cuts grow a little; the sum over all leaves is the same, and
/// what the rounding of powers costs without jitter is printed.
#[test]
fn compact_nodes_cost_little() {
    let context = TestContext::new();
    let (fixture, emitted, reflected) = corner_fixture(&context);
    let run = |node_layout, gather_threshold, gather_jitter| {
        let settings = Settings { node_layout, gather_threshold, gather_jitter, ..ALL_SEEN };
        let gather = fixture.gather(&context, settings, &emitted, &reflected, 1);
        let off = error(&fixture, &gather, &reflected);
        println!(
            "{node_layout:?}, threshold {gather_threshold}, jitter {gather_jitter}: off by {off:.4}; {}",
            gather.report
        );
        (off, gather.report.mean_cut)
    };
    // Leaves are drawn with known probability, whatever the rounding: no error at all.
    assert!(run(NodeLayout::Compact, 0.0, true).0 < 4e-3);
    for threshold in [0.01, 0.1] {
        let [(wide, cut), (compact, larger_cut)] =
            [NodeLayout::Wide, NodeLayout::Compact].map(|layout| run(layout, threshold, false));
        assert!(larger_cut > 0.97 * cut && larger_cut < 1.5 * cut, "{larger_cut} for {cut}");
        assert!(compact < wide + 0.02, "{compact} for {wide}");
    }
}

/// A closed room of albedo 1/2 whose walls emit radiance 1 and reflect a radiosity of pi / 2.        [common ground]
#[test]
fn the_furnace_stays_within_a_percent() {
    let context = TestContext::new();
    let scene = builtin::open("builtin:furnace", &LoadOptions::default()).unwrap();
    let view = view(Vec3::new(0.2, 0.1, 0.3), Vec3::new(-0.8, -0.6, -1.0), 0.9);
    let fixture = Fixture::new(&context, &scene, &Environment::default(), true, view);
    let count = fixture.leaves.len();
    let settings = Settings { gather_visibility: Visibility::Rays, gather_jitter: true, ..ALL_SEEN };
    for threshold in [0.0, 0.1] {
        let settings = Settings { gather_threshold: threshold, ..settings };
        let (emitted, reflected) = (vec![Vec3::splat(PI); count], vec![Vec3::splat(0.5 * PI); count]);
        let gather = fixture.gather(&context, settings, &emitted, &reflected, 8);
        let mean = |values: &[Vec3]| values.iter().map(|v| v.as_dvec3()).sum::<DVec3>().x / values.len() as f64;
        let (direct, indirect) = (mean(&gather.direct), mean(&gather.indirect));
        println!("furnace, threshold {threshold}: direct {direct:.5}, indirect {indirect:.5}; {}", gather.report);
        assert!((direct / 1.5 - 1.0).abs() < 0.01, "{direct}");
        assert!((indirect / 0.25 - 1.0).abs() < 0.01, "{indirect}");
    }
}

/// A lid over the floor takes all light of the ceiling above it; seen through, none.
#[test]
fn senders_behind_a_wall_are_not_seen() {
    let context = TestContext::new();
    let floor = parallelogram(Vec3::new(-1.0, 0.0, 1.0), Vec3::X * 2.0, Vec3::NEG_Z * 2.0, 4, 0);
    let lid = parallelogram(Vec3::new(-30.0, 1.0, 30.0), Vec3::X * 60.0, Vec3::NEG_Z * 60.0, 1, 0);
    let ceiling = parallelogram(Vec3::new(-1.0, 2.0, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0, 4, 0);
    let scene = scene(vec![one_sided(ALBEDO)], vec![floor, lid, ceiling], &[]);
    let view = view(Vec3::new(0.0, 0.8, 1.5), Vec3::ZERO, 0.5);
    let fixture = Fixture::new(&context, &scene, &Environment::default(), true, view);
    let sent: Vec<Vec3> =
        fixture.leaves.iter().map(|leaf| Vec3::splat(f32::from(u8::from(leaf.centre.y > 1.5)))).collect();
    let dark = vec![Vec3::ZERO; sent.len()];
    for (gather_visibility, is_dark) in [(Visibility::Rays, true), (Visibility::None, false)] {
        let gather = fixture.gather(&context, Settings { gather_visibility, ..ALL_SEEN }, &dark, &sent, 1);
        let brightest = gather.indirect.iter().map(|v| v.x).fold(0.0, f32::max);
        assert_eq!(brightest == 0.0, is_dark, "{brightest}");
    }
}

/// Clamping darkens corners, says by how much, and by exactly what is missing.
#[test]
fn what_clamping_takes_is_reported() {
    let context = TestContext::new();
    let (fixture, emitted, reflected) = corner_fixture(&context);
    let black = vec![Vec3::ZERO; emitted.len()];
    let exact = fixture.gather(&context, ALL_SEEN, &black, &reflected, 1);
    let settings = Settings { gather_clamp: 4.0, ..ALL_SEEN };
    let clamped = fixture.gather(&context, settings, &black, &reflected, 1);
    let mean = |values: &[Vec3]| values.iter().sum::<Vec3>() / values.len() as f32;
    let missing = mean(&exact.indirect) - mean(&clamped.indirect);
    println!("{}; missing {missing}", clamped.report);
    assert!(missing.min_element() > 1e-3);
    assert!((missing - clamped.report.lost).abs().max_element() < 1e-4 * mean(&exact.indirect).max_element());
}

#[test]
fn a_picture_is_the_same_to_the_bit() {
    let context = TestContext::new();
    let (fixture, emitted, reflected) = corner_fixture(&context);
    let settings =
        Settings { gather_visibility: Visibility::Rays, gather_threshold: 0.05, gather_jitter: true, ..ALL_SEEN };
    let run = || fixture.gather(&context, settings, &emitted, &reflected, 2);
    let (first, second) = (run(), run());
    assert!(first.direct == second.direct && first.indirect == second.indirect);
}

/// A plane under an even sky reflects rho L, by importance or by cosine.
#[test]
fn an_even_sky_gives_its_radiance_times_the_albedo() {
    let context = TestContext::new();
    let floor = parallelogram(Vec3::new(-9.0, 0.0, 9.0), Vec3::X * 18.0, Vec3::NEG_Z * 18.0, 2, 0);
    let scene = scene(vec![one_sided(ALBEDO)], vec![floor], &[]);
    let view = view(Vec3::new(0.0, 2.0, 1.5), Vec3::ZERO, 0.3);
    let sky = Environment::Constant(Vec3::new(1.0, 2.0, 0.5));
    let fixture = Fixture::new(&context, &scene, &sky, true, view);
    let dark = vec![Vec3::ZERO; fixture.leaves.len()];
    let gather = fixture.gather(&context, ALL_SEEN, &dark, &dark, 1);
    for direct in &gather.direct {
        let error = (*direct / (ALBEDO * Vec3::new(1.0, 2.0, 0.5)) - Vec3::ONE).abs().max_element();
        assert!(error < 1e-4, "{direct}");
    }
}

/// Polished metal under an even sky reflects nearly all of it, at every pixel: directions follow the lobe.
#[test]
fn metal_under_an_even_sky_has_no_sparkles() {
    let context = TestContext::new();
    let floor = parallelogram(Vec3::new(-9.0, 0.0, 9.0), Vec3::X * 18.0, Vec3::NEG_Z * 18.0, 2, 0);
    let metal = Material { metallic: 1.0, roughness: 0.3, ..one_sided(1.0) };
    let scene = scene(vec![metal], vec![floor], &[]);
    let view = view(Vec3::new(0.0, 2.0, 1.5), Vec3::ZERO, 0.3);
    let fixture = Fixture::new(&context, &scene, &Environment::Constant(Vec3::ONE), false, view);
    let dark = vec![Vec3::ZERO; fixture.leaves.len()];
    let settings = Settings { environment_samples: 4, ..ALL_SEEN };
    let gather = fixture.gather(&context, settings, &dark, &dark, 1);
    let mean = gather.direct.iter().map(|v| v.x).sum::<f32>() / gather.direct.len() as f32;
    let most = gather.direct.iter().map(|v| v.x).fold(0.0, f32::max);
    println!("{mean} in the mean, {most} at most");
    // A tenth of the directions is drawn as if the surface were matt, and brings little.
    assert!((0.9..1.0).contains(&mean) && most < 1.1, "{mean} {most}");
}
