//! Closed forms and conservation laws.

use crate::common::TestContext;
use crate::common::lobe::specular_albedo;
use crate::common::scenes::{lambert, light, one_sided_box, parallelogram, scene};
use crate::fixture::{Fixture, builtin_scene};
use crate::support::{Solution, prepare, settings, solve};
use glam::{DVec3, Vec3, Vec4};
use linklight::methods::antiradiance::{AntiradianceError, Scheme, Settings};
use linklight::scene::environment::{Environment, EnvironmentMap};
use linklight::scene::pose::Pose;
use linklight::scene::shapes::Shape;
use linklight::scene::{LightKind, Material, Primitive};
use linklight::stages::emitters::EmitterChoice;
use linklight::stages::work::Unwatched;
use std::collections::HashMap;
use std::f32::consts::PI;

fn one_sided(albedo: f32) -> Material {
    Material { double_sided: false, ..lambert(Vec3::splat(albedo)) }
}

/// Mean over elements, by area.
fn mean(values: &[Vec3], area: &[f32]) -> f64 {
    let total: f64 = area.iter().map(|a| f64::from(*a)).sum();
    values.iter().zip(area).map(|(e, a)| f64::from(e.x * a)).sum::<f64>() / total
}

/// A closed room of albedo 1/2 that emits 1 everywhere: each bounce has half of what the one before had.
#[test]
fn the_furnace_gains_half_of_each_bounce() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("furnace"), Some(0.6));
    let mut method = prepare(&context, &fixture, Settings { refinement: 4.0, ..settings(512) });
    let area = context.download(&method.elements().area).unwrap();
    let mut before = 0.0;
    for bounces in 0..=4u32 {
        let solution = solve(&context, &mut method, &fixture, bounces);
        let own = mean(&solution.direct, &area) + mean(&solution.indirect, &area);
        let bounce = own - before;
        before = own;
        let expected = f64::from(PI) / 2f64.powi(bounces as i32);
        println!(
            "bounce {bounces}: {bounce:.4} W/m2, closed form {expected:.4}, off by {:+.2} %",
            100.0 * (bounce / expected - 1.0)
        );
        // Each half of the one before.
        let most = 0.006 * f64::from(bounces + 1);
        assert!((bounce / expected - 1.0).abs() < most, "bounce {bounces}: {bounce} for {expected}");
        assert!((own / (2.0 * f64::from(PI) - expected) - 1.0).abs() < 0.02, "{own} after {bounces}");
        let worst = solution.direct.iter().map(|e| (e.x / PI - 1.0).abs()).fold(0.0, f32::max);
        assert!(worst < 0.15, "every element's direct light: {worst}");
    }
}

/// Every leaf of a room that emits evenly receives the same, whatever nodes its links end at; without scales the edges of the room
/// are too bright, and what lies away from them too dark.
#[test]
fn an_even_light_arrives_evenly() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("furnace"), Some(0.25));
    let error = |even_receivers: bool| {
        let mut method = prepare(&context, &fixture, Settings { refinement: 3.0, even_receivers, ..settings(128) });
        let direct = solve(&context, &mut method, &fixture, 0).direct;
        let mut errors: Vec<f32> = direct.iter().map(|e| e.x / PI - 1.0).collect();
        let rms = (errors.iter().map(|e| e * e).sum::<f32>() / errors.len() as f32).sqrt();
        errors.sort_by(f32::total_cmp);
        let at = |share: f32| 100.0 * errors[((errors.len() - 1) as f32 * share) as usize];
        println!(
            "{}, scaled {even_receivers}: off by {:.2} % rms, {:+.2} to {:+.2} % (all but a twentieth at each end {:+.2} to {:+.2})",
            method.report(),
            100.0 * rms,
            at(0.0),
            at(1.0),
            at(0.05),
            at(0.95)
        );
        rms
    };
    let (plain, even) = (error(false), error(true));
    assert!(plain > 0.04 && even < 0.5 * plain, "{even} of {plain}");
}

/// Without light it is dark, and twice the light is twice the light.
#[test]
fn light_is_linear_and_darkness_is_dark() {
    let context = TestContext::new();
    let lit = |intensity: f32| {
        let mut scene = builtin_scene("two-rooms");
        scene.lights.iter_mut().for_each(|light| light.intensity *= intensity);
        let emission = if intensity > 0.0 { intensity } else { 0.0 };
        scene.materials.iter_mut().for_each(|material| material.emission *= emission);
        let fixture = Fixture::new(&context, scene, Some(1.6));
        let mut method = prepare(&context, &fixture, settings(72));
        solve(&context, &mut method, &fixture, 2).indirect
    };
    assert!(lit(0.0).iter().all(|e| *e == Vec3::ZERO));
    let (one, two) = (lit(1.0), lit(2.0));
    assert!(one.iter().any(|e| e.x > 0.0));
    for (one, two) in one.iter().zip(&two) {
        assert!((2.0 * *one - *two).abs().max_element() <= 1e-4 * two.max_element() + 1e-6, "{one} and {two}");
    }
}

/// An open plane under an even sky receives pi L, from a sky of a map as well.
#[test]
fn an_even_sky_gives_pi_times_its_radiance() {
    let context = TestContext::new();
    let radiance = Vec3::new(0.5, 1.0, 2.0);
    let map = EnvironmentMap { width: 8, height: 4, texels: vec![radiance; 32], rotation: 0.4 };
    for sky in [Environment::Constant(radiance), Environment::Map(map)] {
        let plane = parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, 4, 0);
        let world = scene(vec![one_sided(0.5)], vec![plane], &[]);
        let fixture = Fixture::posed(&context, world, None, sky, Pose::rest);
        let mut method = prepare(&context, &fixture, settings(128));
        for irradiance in &solve(&context, &mut method, &fixture, 0).direct {
            assert!((*irradiance / (PI * radiance) - Vec3::ONE).abs().max_element() < 1e-3, "{irradiance}");
        }
    }
}

/// Below a wide lid a floor sees none of the sky, whichever way the lid faces: antiradiance took it away.
#[test]
fn a_lid_takes_the_sky_away() {
    let context = TestContext::new();
    for (u, v) in [(Vec3::X, Vec3::Z), (Vec3::X, Vec3::NEG_Z)] {
        let floor = parallelogram(Vec3::new(-1.0, 0.0, 1.0), Vec3::X * 2.0, Vec3::NEG_Z * 2.0, 6, 0);
        let corner = -8.0 * (u + v) + Vec3::Y * 0.8;
        let lid = parallelogram(corner, 16.0 * u, 16.0 * v, 28, 0);
        let world = scene(vec![one_sided(0.0)], vec![floor, lid], &[]);
        let fixture = Fixture::posed(&context, world, None, Environment::Constant(Vec3::ONE), Pose::rest);
        for (undershoot, most) in [(0.0, 0.15), (0.5, 0.05), (1e9, 0.05)] {
            let mut method = prepare(&context, &fixture, Settings { refinement: 2.0, undershoot, ..settings(128) });
            let area = context.download(&method.elements().area).unwrap();
            let direct = solve(&context, &mut method, &fixture, 0).direct;
            let (floor, sky) = (mean(&direct[..49], &area[..49]), f64::from(PI));
            println!(
                "under a lid facing {}, undershoot {undershoot}: {:.4} of the sky is left",
                u.cross(v),
                floor / sky
            );
            // What is left comes from below the lid's edge (1 %) and through bins that it covers unevenly.
            assert!(floor / sky < most, "{}", floor / sky);
        }
    }
}

/// A wall takes its half of the sky from a strip along its foot, however much narrower than the wall's cells that is.
#[test]
fn a_wall_takes_the_sky_away_from_beside_it() {
    let context = TestContext::new();
    for width in [0.3, 0.02] {
        let strip = parallelogram(Vec3::new(-1.0, 0.0, width), Vec3::X * 2.0, Vec3::NEG_Z * width, 8, 0);
        let wall = parallelogram(Vec3::new(-8.0, 0.0, 0.0), Vec3::X * 16.0, Vec3::Y * 8.0, 32, 0);
        let world = scene(vec![one_sided(0.0)], vec![strip, wall], &[]);
        let fixture = Fixture::posed(&context, world, None, Environment::Constant(Vec3::ONE), Pose::rest);
        for bins in [128, 512] {
            let mut method = prepare(&context, &fixture, settings(bins));
            let direct = solve(&context, &mut method, &fixture, 0).direct;
            let strip = 0..9 * 9;
            let [least, most] = strip.fold([f32::MAX, 0.0], |[least, most], element| {
                let left = direct[element].x / PI;
                [f32::min(least, left), f32::max(most, left)]
            });
            println!("{width} m wide, {bins} bins: from {least:.3} to {most:.3} of the sky is left");
            // Half of it lies on the open side; bins that the wall's plane or edge cuts are coarse.
            assert!(least > 0.45 && most < 0.62, "{width} m, {bins} bins: {least} to {most}");
        }
    }
}

/// Form factors between facing plates, unoccluded.
#[test]
fn form_factors_of_plates_are_right() {
    let context = TestContext::new();
    for (name, exact) in [("parallel-plates", 0.199_825), ("perpendicular-plates", 0.200_044)] {
        for bins in [128, 512] {
            let fixture = Fixture::new(&context, builtin_scene(name), Some(0.1));
            let settings = Settings { emitters: EmitterChoice::Linked, ..settings(bins) };
            let mut method = prepare(&context, &fixture, settings);
            let solution = solve(&context, &mut method, &fixture, 0);
            let albedo = context.download(&method.elements().albedo).unwrap();
            let area = context.download(&method.elements().area).unwrap();
            let lit = |e: usize| albedo[e].x > 0.5;
            let (mut power, mut total) = (0.0, 0.0);
            for e in (0..albedo.len()).filter(|&e| lit(e)) {
                power += f64::from(area[e] * solution.direct[e].x);
                total += f64::from(area[e]);
            }
            let found = power / total;
            println!("{name}, {bins} bins: form factor {found:.6}, off by {:+.2} %", 100.0 * (found / exact - 1.0));
            assert!((found / exact - 1.0).abs() < 0.03, "{name}: {found} for {exact}");
        }
    }
}

/// What leaks through walls one polygon thick, and through a closed door.
#[test]
fn a_closed_door_leaks_little() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("two-rooms"), Some(0.5));
    // What the wall's nodes take away is what arrives at their centres, on average: in links as coarse as these, one in a hundred.
    for (bins, undershoot, most) in [(128, 0.5, 0.012), (512, 0.5, 0.009), (128, 1e9, 0.0085)] {
        let mut method = prepare(&context, &fixture, Settings { refinement: 4.0, undershoot, ..settings(bins) });
        let area = context.download(&method.elements().area).unwrap();
        let solution = solve(&context, &mut method, &fixture, 4);
        let (mut dark, mut lit) = ((0.0, 0.0), (0.0, 0.0));
        for (element, position) in fixture.rest_positions.iter().enumerate() {
            let room = if position.x > 0.0 { &mut dark } else { &mut lit };
            room.0 += f64::from(area[element] * solution.indirect[element].element_sum());
            room.1 += f64::from(area[element]);
        }
        let leak = (dark.0 / dark.1) / (lit.0 / lit.1);
        println!(
            "two-rooms, {bins} bins, undershoot {undershoot}: the dark room receives {:.3} % of the lit one's light",
            100.0 * leak
        );
        assert!(leak < most, "{leak}");
    }
}

/// Surfaces that reflect three times what they receive have no solution: the growth is told, with its rate.
#[test]
fn light_that_grows_is_refused() {
    let context = TestContext::new();
    let mut world = builtin_scene("furnace");
    world.materials.iter_mut().for_each(|m| m.base_color = Vec4::new(3.0, 3.0, 3.0, 1.0));
    let fixture = Fixture::new(&context, world, Some(1.0));
    let settings = Settings { scheme: Scheme::Symmetric, iterations: 40, ..settings(128) };
    let mut method = prepare(&context, &fixture, settings);
    match method.solve(&context, &fixture.world, 4, &Unwatched) {
        Err(error @ AntiradianceError::Growth { rate, .. }) => {
            assert!((2.0..4.0).contains(&rate), "{rate}");
            assert!(error.to_string().contains("scheme=asymmetric"), "{error}");
        }
        other => panic!("{other:?}"),
    }
}

/// A point light over a floor with a wall: indirect light falls on the floor's lit side of the wall alone.
#[test]
fn a_thin_wall_shades_reflected_light() {
    let context = TestContext::new();
    let floor = parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, 16, 0);
    let wall = parallelogram(Vec3::new(0.0, 0.0, 2.0), Vec3::NEG_Z * 4.0, Vec3::Y * 2.0, 12, 0);
    let side = parallelogram(Vec3::new(-2.0, 0.0, -2.0), Vec3::Y * 2.0, Vec3::Z * 4.0, 12, 0);
    let lamp = (light(LightKind::Point, 5.0), Vec3::new(-1.2, 1.5, 0.0), Vec3::NEG_Y);
    let world = scene(vec![lambert(Vec3::splat(0.8))], vec![floor, wall, side], &[lamp]);
    let fixture = Fixture::new(&context, world, None);
    let mut method = prepare(&context, &fixture, settings(200));
    let indirect = solve(&context, &mut method, &fixture, 2).indirect;
    let on_floor = |range: std::ops::Range<f32>| {
        let near = (0..17 * 17).filter(|&e| range.contains(&fixture.rest_positions[e].x));
        let light: Vec<f32> = near.map(|e| indirect[e].x).collect();
        light.iter().sum::<f32>() / light.len() as f32
    };
    let (lit, shaded) = (on_floor(-1.6..-0.4), on_floor(0.4..1.6));
    println!("beside a thin wall {lit:.4} W/m2, behind it {shaded:.5}: {:.2} % leak", 100.0 * shaded / lit);
    assert!(lit > 0.0 && shaded < 0.05 * lit, "{shaded} behind, {lit} before");
}

/// A board with rounded edges, lit on one side and alone in the world: its mesh goes round the edges, its light does not.
#[test]
fn a_rounded_board_is_dark_behind() {
    let context = TestContext::new();
    let board = Shape::rounded_cuboid(Vec3::new(-2.0, 0.0, -0.1), Vec3::new(2.0, 2.0, 0.1), 0.015);
    let primitive = Primitive {
        tangents: vec![Vec4::new(1.0, 0.0, 0.0, 1.0); board.positions.len()],
        colors: vec![Vec4::ONE; board.positions.len()],
        uv: [board.uv.clone(), board.uv],
        positions: board.positions,
        normals: board.normals,
        triangles: board.triangles,
        ..Primitive::default()
    };
    let lamp = (light(LightKind::Point, 50.0), Vec3::new(0.3, 1.0, 2.0), Vec3::NEG_Z);
    let fixture = Fixture::new(&context, scene(vec![one_sided(0.8)], vec![primitive], &[lamp]), Some(0.35));
    let mut method = prepare(&context, &fixture, Settings { refinement: 3.0, ..settings(128) });
    let solution = solve(&context, &mut method, &fixture, 1);
    let punctual = context.download(method.punctual_irradiance()).unwrap();
    let most = |values: &[Vec3], behind: bool| {
        let there = fixture.rest_positions.iter().zip(values).filter(|(at, _)| (at.z < -0.099) == behind);
        there.map(|(_, light)| light.x).fold(0.0, f32::max)
    };
    assert!(most(&punctual, false) > 5.0 && most(&punctual, true) == 0.0);
    println!("behind a board lit by {:.1}: {:.2e} W/m2", most(&punctual, false), most(&solution.indirect, true));
    assert!(most(&solution.indirect, true) == 0.0, "{}", most(&solution.indirect, true));
}

/// A closed room of rough metal that emits 1 everywhere: each bounce has what its lobes reflect of the one before.
#[test]
fn a_glossy_furnace_neither_makes_nor_loses_light() {
    let context = TestContext::new();
    let mut world = builtin_scene("furnace");
    for material in &mut world.materials {
        material.base_color = Vec4::new(0.5, 0.5, 0.5, 1.0);
        (material.metallic, material.roughness, material.double_sided) = (1.0, 0.5, false);
    }
    let mut fixture = Fixture::new(&context, world, Some(0.75));
    fixture.world = linklight::stages::world::World::new(
        &context,
        &fixture.scene,
        &fixture.geometry,
        &Pose::rest(&fixture.scene),
        &fixture.environment,
        false,
    )
    .unwrap();
    let mut method = prepare(&context, &fixture, Settings { refinement: 2.0, ..settings(128) });
    assert_eq!(method.tables().gloss.count, method.report().leaves, "all of it is metal");
    let area = context.download(&method.elements().area).unwrap();
    let bounces: Vec<f64> = (0..=3)
        .map(|bounces| {
            let solution = solve(&context, &mut method, &fixture, bounces);
            mean(&solution.direct, &area) + mean(&solution.indirect, &area)
        })
        .collect();
    // What arrives first is emission; what arrives next was reflected by lobes alone: by their albedo, averaged over the
    // hemisphere.
    let alpha = (0.25f64.powi(2) + 1.0 / 128.0).sqrt();
    let albedo = |cosine: f64| specular_albedo(DVec3::splat(0.5), 1.0, alpha, cosine).x;
    let steps = (0..1000).map(|k| (f64::from(k) + 0.5) / 1000.0);
    let expected = steps.map(|cosine| 2.0 * cosine * albedo(cosine) / 1000.0).sum::<f64>();
    let ratio =
        |k: usize| (bounces[k + 1] - bounces[k]) / if k == 0 { bounces[0] } else { bounces[k] - bounces[k - 1] };
    println!(
        "glossy furnace: expected {expected:.4}; E0 {:.4}, each bounce has {:.4}, {:.4}, {:.4} of the one before",
        bounces[0],
        ratio(0),
        ratio(1),
        ratio(2)
    );
    assert!((0..3).all(|k| (ratio(k) / expected - 1.0).abs() < 0.03), "{bounces:?}, expected {expected}");
}

/// Corners of a wall behind its skirting show what arrives above it, and send nothing.
#[test]
fn corners_inside_of_boards_show_the_light_beside_them() {
    let context = TestContext::new();
    let (low, high) = (Vec3::new(-0.1, -0.02, -0.04), Vec3::new(1.1, 0.07, 0.03));
    let mut parts = vec![parallelogram(Vec3::ZERO, Vec3::X, Vec3::Y * 0.6, 12, 0)];
    parts.extend(one_sided_box(low, high, 12));
    parts.push(parallelogram(low, Vec3::X * (high.x - low.x), Vec3::Z * (high.z - low.z), 12, 0));
    let lamp = light(LightKind::Point, 1.0);
    let world = scene(vec![one_sided(0.5)], parts, &[(lamp, Vec3::new(0.5, 0.5, 1.0), Vec3::NEG_Z)]);
    let fixture = Fixture::posed(&context, world, None, Environment::Constant(Vec3::ONE), Pose::rest);
    for smoothing in [false, true] {
        let mut method = prepare(&context, &fixture, Settings { smoothing, ..settings(128) });
        let Solution { direct, indirect } = solve(&context, &mut method, &fixture, 1);
        let punctual = context.download(method.punctual_irradiance()).unwrap();
        let radiosity = context.download(&method.tables().radiosity).unwrap();
        let sent: HashMap<u32, f32> = method
            .hierarchy()
            .plan
            .leaves
            .iter()
            .map(|leaf| leaf.element)
            .zip(radiosity.chunks(2).map(|sides| sides[0].x))
            .collect();
        for (hidden, open) in (0..26).map(|element| (element, 26 + element % 13)) {
            // Of columns beside each other the own is the nearest.
            for light in [&direct, &punctual, &indirect] {
                assert_eq!(light[hidden], light[open], "corner {hidden}");
            }
            let [of_hidden, of_open] = [hidden, open].map(|element| sent[&(element as u32)]);
            assert!(of_hidden < 0.5 * of_open, "corner {hidden} sends {of_hidden}, one in the open {of_open}");
        }
    }
}
