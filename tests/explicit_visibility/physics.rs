//! Closed forms and conservation laws.

use crate::common::TestContext;
use crate::common::scenes::{assert_as_in_the_open, lambert, light, parallelogram, scene, strip_between_boards};
use crate::fixture::{Fixture, builtin_scene, solve};
use glam::Vec3;
use linklight::methods::explicit_visibility::Settings;
use linklight::scene::environment::{Environment, EnvironmentMap};
use linklight::scene::pose::Pose;
use linklight::scene::{LightKind, Material};
use std::f32::consts::PI;

fn one_sided(albedo: f32) -> Material {
    Material { double_sided: false, ..lambert(Vec3::splat(albedo)) }
}

/// A closed room of albedo 1/2 that emits 1 everywhere: after k bounces the radiance is 2 - 2^-k.   [common ground]
#[test]
fn the_furnace_gains_half_of_each_bounce() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("furnace"), Some(0.75));
    let method = fixture.prepare(&context, Settings::default());
    let report = method.report();
    println!("{report:#?}");
    assert_eq!(report.escaped_rays, 0, "a closed room");
    for bounces in 0..=8u32 {
        let solution = solve(&context, &method, &fixture.world, bounces);
        // E_k = pi / 2^k, each bounce by itself.
        let expected = PI / 2f32.powi(bounces as i32);
        for (element, last) in solution.last.iter().enumerate() {
            let error = (*last / expected - Vec3::ONE).abs().max_element();
            assert!(error < 1e-2, "bounce {bounces}, element {element}: {last}, expected {expected}");
        }
        let radiance = 1.0 + 0.5 / PI * (solution.direct[0].x + solution.indirect[0].x);
        let closed_form = 2.0 - 0.5f32.powi(bounces as i32 + 1);
        assert!((radiance - closed_form).abs() < 1e-2 * closed_form, "{bounces} bounces: {radiance}");
    }
}

/// A point light over a plane: I cos / r^2.                                                       [common ground]
#[test]
fn a_point_light_falls_with_the_square_of_the_distance() {
    let context = TestContext::new();
    let plane = parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, 8, 0);
    let lamp = (light(LightKind::Point, 7.0), Vec3::new(0.5, 1.5, -0.25), Vec3::NEG_Y);
    let fixture = Fixture::new(&context, scene(vec![one_sided(0.5)], vec![plane], &[lamp]), None);
    let method = fixture.prepare(&context, Settings::default());
    let solution = solve(&context, &method, &fixture.world, 1);
    for (position, irradiance) in fixture.rest_positions.iter().zip(&solution.punctual) {
        let offset = Vec3::new(0.5, 1.5, -0.25) - *position;
        let expected = 7.0 * offset.y / offset.length().powi(3);
        assert!((irradiance.x - expected).abs() < 1e-5 * expected, "{position}: {irradiance}, expected {expected}");
    }
    assert!(solution.indirect.iter().all(|&e| e == Vec3::ZERO), "a plane sends no light to itself");
}

/// An open plane under an even sky receives pi L; through a lid over half of the sky, what is left of it.
#[test]
fn an_even_sky_gives_pi_times_its_radiance() {
    let context = TestContext::new();
    let plane = parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, 4, 0);
    let sky = Environment::Constant(Vec3::new(0.5, 1.0, 2.0));
    for rotate_rays in [false, true] {
        let fixture = Fixture::posed(
            &context,
            scene(vec![one_sided(0.5)], vec![plane.clone()], &[]),
            None,
            sky.clone(),
            Pose::rest,
        );
        let mut method = fixture.prepare(&context, Settings { rotate_rays, ..Settings::default() });
        let solution = solve(&context, &method, &fixture.world, 0);
        for irradiance in &solution.direct {
            let error = (*irradiance / (PI * Vec3::new(0.5, 1.0, 2.0)) - Vec3::ONE).abs().max_element();
            assert!(error < 1e-5, "{irradiance}");
        }

        // Another sky is seen through the same rays: as if prepared for it.
        let map = EnvironmentMap {
            width: 8,
            height: 4,
            texels: (0..32).map(|i| Vec3::new(i as f32, 1.0, (i % 5) as f32)).collect(),
            rotation: 0.7,
        };
        method.set_environment(&context, &Environment::Map(map.clone())).unwrap();
        let relit = solve(&context, &method, &fixture.world, 0);
        let other = Fixture { environment: Environment::Map(map), ..fixture };
        let fresh = solve(&context, &other.prepare(&context, *method.settings()), &other.world, 0);
        assert_eq!(relit.direct, fresh.direct);
        assert!(relit.direct.iter().all(|e| e.x > 1.0 && e.x.is_finite()));
    }
}

/// A strip of wall whose corners all lie inside of boards is as bright as what of it lies in the open.
#[test]
fn corners_inside_of_boards_receive_what_arrives_in_the_open() {
    let context = TestContext::new();
    let sky = Environment::Constant(Vec3::ONE);
    let fixture = Fixture::posed(&context, strip_between_boards(), None, sky, Pose::rest);
    let method = fixture.prepare(&context, Settings::default());
    assert_as_in_the_open(&solve(&context, &method, &fixture.world, 0).direct);
}
