//! Closed forms and conservation laws.

use crate::common::TestContext;
use crate::common::scenes::{assert_as_in_the_open, lambert, light, parallelogram, scene, strip_between_boards};
use crate::fixture::{Fixture, builtin_scene, solve};
use glam::Vec3;
use linklight::methods::implicit_visibility::{Footprint, Frames, Settings, Transport};
use linklight::scene::environment::Environment;
use linklight::scene::pose::Pose;
use linklight::scene::{LightKind, Material};
use std::f32::consts::PI;

fn one_sided(albedo: f32) -> Material {
    Material { double_sided: false, ..lambert(Vec3::splat(albedo)) }
}

/// A closed room of albedo 1/2 that emits 1 everywhere: bounce k brings pi / 2^k.                 [common ground]
#[test]
fn the_furnace_gains_half_of_each_bounce() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("furnace"), Some(0.6));
    for frames in [Frames::World, Frames::Surface] {
        let method = fixture.linked(&context, Settings { bins: 16, frames, ..Settings::default() });
        for bounces in [0u32, 1, 2, 6] {
            let solution = solve(&context, &method, &fixture.world, bounces);
            let expected = PI / 2f32.powi(bounces as i32);
            let relative = |e: &Vec3| e.x / expected;
            let mean = solution.last.iter().map(relative).sum::<f32>() / solution.last.len() as f32;
            let lowest = solution.last.iter().map(relative).fold(f32::MAX, f32::min);
            let highest = solution.last.iter().map(relative).fold(0.0, f32::max);
            println!("{frames:?}, bounce {bounces}: mean {mean:.5}, {lowest:.5} to {highest:.5}");
            assert!((mean - 1.0).abs() < 0.02 && lowest > 0.9 && highest < 1.0001, "{lowest} {mean} {highest}");
        }
    }
}

/// Without footprints, light of Eq. 5 is lost where leaves are larger than bins: the test above can fail.
#[test]
fn single_bins_lose_light_in_the_furnace() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("furnace"), Some(0.6));
    let single = Settings { bins: 16, footprint: Footprint::Single, ..Settings::default() };
    for settings in [single, Settings { transport: Transport::Disc, ..single }] {
        let method = fixture.linked(&context, settings);
        let solution = solve(&context, &method, &fixture.world, 1);
        let mean = solution.last.iter().map(|e| e.x / (0.5 * PI)).sum::<f32>() / solution.last.len() as f32;
        println!("{:?}: {mean}", settings.transport);
        assert!((mean - 1.0).abs() > 0.02);
    }
}

/// An open plane under an even sky receives pi L, whatever the bins.
#[test]
fn an_even_sky_gives_pi_times_its_radiance() {
    let context = TestContext::new();
    let plane = parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, 4, 0);
    let radiance = Vec3::new(0.5, 1.0, 2.0);
    let scene = scene(vec![one_sided(0.5)], vec![plane], &[]);
    let fixture = Fixture::posed(&context, scene, None, Environment::Constant(radiance), Pose::rest);
    for (bins, frames, spin) in [(2, Frames::World, 0.0), (8, Frames::World, 30.0), (7, Frames::Surface, 0.0)] {
        let method = fixture.linked(&context, Settings { bins, frames, spin, ..Settings::default() });
        let solution = solve(&context, &method, &fixture.world, 1);
        for irradiance in &solution.direct {
            let error = (*irradiance / (PI * radiance) - Vec3::ONE).abs().max_element();
            assert!(error < 1e-4, "{irradiance}");
        }
        assert!(solution.indirect.iter().all(|&e| e == Vec3::ZERO), "a plane sends no light to itself");
    }
}

/// A point light over a plane: I cos / r^2.                                                       [common ground]
#[test]
fn a_point_light_falls_with_the_square_of_the_distance() {
    let context = TestContext::new();
    let plane = parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, 8, 0);
    let at = Vec3::new(0.5, 1.5, -0.25);
    let lamp = (light(LightKind::Point, 7.0), at, Vec3::NEG_Y);
    let fixture = Fixture::new(&context, scene(vec![one_sided(0.5)], vec![plane], &[lamp]), None);
    let method = fixture.linked(&context, Settings { bins: 4, ..Settings::default() });
    let solution = solve(&context, &method, &fixture.world, 0);
    for (position, irradiance) in fixture.rest_positions.iter().zip(&solution.punctual) {
        let offset = at - *position;
        let expected = 7.0 * offset.y / offset.length().powi(3);
        assert!((irradiance.x - expected).abs() < 1e-5 * expected, "{position}: {irradiance}, expected {expected}");
    }
}

/// Behind a closed door: next to dark with footprints; how much leaks with and without is printed.
#[test]
fn little_leaks_through_a_closed_door() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("two-rooms"), Some(0.8));
    let leak = |settings: Settings| {
        let method = fixture.linked(&context, settings);
        let solution = solve(&context, &method, &fixture.world, 4);
        let area = context.download(&method.elements().area).unwrap();
        let mut power = [0.0f64; 2];
        for (element, position) in fixture.rest_positions.iter().enumerate() {
            let light = solution.direct[element] + solution.indirect[element];
            power[usize::from(position.x > 0.0)] += f64::from(light.element_sum() * area[element]);
        }
        power[1] / power[0]
    };
    let covered = leak(Settings { bins: 8, ..Settings::default() });
    let single = leak(Settings { bins: 8, footprint: Footprint::Single, fill_holes: false, ..Settings::default() });
    println!("two-rooms, N = 8: leaked share {covered:.2e} with footprints, {single:.2e} without");
    assert!(covered < 5e-3 && 5.0 * covered < single, "{covered} {single}");
}

/// A strip of wall whose corners all lie inside of boards is as bright as what of it lies in the open.
#[test]
fn corners_inside_of_boards_receive_what_arrives_in_the_open() {
    let context = TestContext::new();
    let sky = Environment::Constant(Vec3::ONE);
    let fixture = Fixture::posed(&context, strip_between_boards(), None, sky, Pose::rest);
    let method = fixture.linked(&context, Settings::default());
    assert_as_in_the_open(&solve(&context, &method, &fixture.world, 0).direct);
}
