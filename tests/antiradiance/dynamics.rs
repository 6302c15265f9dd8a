//! What moves, and what must not differ.

use crate::common::TestContext;
use crate::common::scenes::{lambert, light, parallelogram, scene};
use crate::fixture::{Fixture, builtin_scene};
use crate::support::{prepare, relative_rmse, settings, solve};
use glam::Vec3;
use linklight::methods::antiradiance::{Antiradiance, Leaves, Settings};
use linklight::methods::carried::Sender;
use linklight::scene::environment::Environment;
use linklight::scene::pose::Pose;
use linklight::scene::{LightKind, Scene, Transform};

#[test]
fn the_same_scene_gives_the_same_bits() {
    let context = TestContext::new();
    let run = || {
        let fixture = Fixture::new(&context, builtin_scene("cornell-box"), Some(0.7));
        let mut method = prepare(&context, &fixture, Settings { half_tables: true, ..settings(128) });
        let solution = solve(&context, &mut method, &fixture, 3);
        (solution.direct, solution.indirect)
    };
    let (first, second) = (run(), run());
    assert!(first == second);
    assert!(first.1.iter().any(|e| *e != Vec3::ZERO));
}

/// A floor, a wall, and a plate over the floor, `height` above it.
fn with_plate(height: f32) -> Scene {
    let floor = parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, 12, 0);
    let wall = parallelogram(Vec3::new(-2.0, 0.0, -2.0), Vec3::X * 4.0, Vec3::Y * 3.0, 10, 0);
    let plate = parallelogram(Vec3::new(-0.5, 0.0, 0.5), Vec3::X, Vec3::NEG_Z, 5, 0);
    let lamp = (light(LightKind::Point, 5.0), Vec3::new(1.0, 2.5, 1.0), Vec3::NEG_Y);
    let mut world = scene(vec![lambert(Vec3::splat(0.7))], vec![floor, wall, plate], &[lamp]);
    world.nodes[2].transform =
        Transform::Trs { translation: Vec3::Y * height, rotation: glam::Quat::IDENTITY, scale: Vec3::ONE };
    world
}

#[test]
fn what_moved_is_followed_with_new_links_and_with_standing_ones() {
    is_followed(Leaves::Vertices);
}

#[test]
fn what_moved_is_followed_by_patches() {
    is_followed(Leaves::Patches);
}

/// What `carried_to` tells of elements adds up to their light, and without a floor links alone brought it.
fn links_carried_it(context: &TestContext, method: &Antiradiance, indirect: &[Vec3]) {
    let elements: Vec<u32> = (0..indirect.len() as u32).step_by(7).collect();
    let carried = method.carried_to(context, &elements).unwrap();
    let brightest = indirect.iter().map(|e| e.max_element()).fold(0.0, f32::max);
    let mut senders = 0;
    for (&element, carried) in elements.iter().zip(&carried) {
        let sum: Vec3 = carried.iter().map(|own| own.irradiance).sum();
        let found = indirect[element as usize];
        assert!((sum - found).abs().max_element() < 1e-4 * brightest, "element {element}: {sum} for {found}");
        let floor = carried.iter().find(|own| own.from == Sender::Floor).map_or(Vec3::ZERO, |own| own.irradiance);
        assert!(
            floor.abs().max_element() < 1e-4 * brightest || found.min_element() <= 0.0,
            "element {element}: {floor}"
        );
        senders += carried.len();
    }
    assert!(senders > 10 * elements.len(), "{senders}");
}

fn is_followed(leaves: Leaves) {
    let context = TestContext::new();
    // Without a floor: what links carry is all there is.
    let settings = Settings { refinement: 2.0, leaves, patch_side: 0.1, undershoot: 1e9, ..settings(128) };
    let mut fixture = Fixture::new(&context, with_plate(0.4), None);
    let mut method = prepare(&context, &fixture, settings);
    method.keep_sent(&context, true).unwrap();
    let before = solve(&context, &mut method, &fixture, 2).indirect;
    links_carried_it(&context, &method, &before);

    let moved = Fixture::new(&context, with_plate(0.7), None);
    let mut fresh = prepare(&context, &moved, settings);
    let expected = solve(&context, &mut fresh, &moved, 2).indirect;
    assert!(relative_rmse(&before, &expected) > 0.05, "the plate's place makes a difference");

    // The world is posed anew; the rest positions are those of before, as in an animation.
    let mut recorder = context.recorder("test").unwrap();
    fixture.world.pose(&mut recorder, &Pose::rest(&moved.scene));
    recorder.submit().unwrap();
    fixture.bvh = moved.bvh;
    let stage = fixture.stage();
    method.follow(&context, &stage, true).unwrap();
    let standing = solve(&context, &mut method, &fixture, 2).indirect;
    links_carried_it(&context, &method, &standing);
    method.follow(&context, &fixture.stage(), false).unwrap();
    let rebuilt = solve(&context, &mut method, &fixture, 2).indirect;
    let errors = [&standing, &rebuilt].map(|light| relative_rmse(light, &expected));
    println!(
        "{} leaves after a move: standing links differ by {:.2e}, new ones by {:.2e}",
        method.report().leaves,
        errors[0],
        errors[1]
    );
    // Standing links are refined for where things were; new ones differ by the shape of the tree alone.
    assert!(errors[0] < 0.05, "{}", errors[0]);
    assert!(errors[1] < 0.01, "{}", errors[1]);
}

/// Light and materials change without any work on links.
#[test]
fn lights_and_materials_need_no_links() {
    let context = TestContext::new();
    let mut fixture = Fixture::posed(&context, with_plate(0.4), None, Environment::default(), Pose::rest);
    let mut method = prepare(&context, &fixture, settings(72));
    let before = solve(&context, &mut method, &fixture, 2).indirect;
    let transfers = method.transfers().download(&context).unwrap();

    let mut changed = with_plate(0.4);
    changed.lights[0].intensity *= Vec3::new(1.0, 0.5, 0.0);
    changed.materials[0].base_color = glam::Vec4::new(0.2, 0.4, 0.6, 1.0);
    let other = Fixture::new(&context, changed, None);
    let mut fresh = prepare(&context, &other, settings(72));
    let expected = solve(&context, &mut fresh, &other, 2).indirect;

    fixture.world = other.world;
    let mut recorder = context.recorder("test").unwrap();
    method.update_materials(&mut recorder, &fixture.world);
    recorder.submit().unwrap();
    let after = solve(&context, &mut method, &fixture, 2).indirect;
    assert!(after == expected && after != before);
    assert!(method.transfers().download(&context).unwrap() == transfers);
}
