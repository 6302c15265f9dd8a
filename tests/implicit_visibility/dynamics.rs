//! What moves, and what must not differ.

use crate::common::TestContext;
use crate::fixture::{Fixture, builtin_scene, solve};
use glam::Vec3;
use linklight::methods::implicit_visibility::Settings;
use linklight::scene::environment::Environment;
use linklight::scene::pose::Pose;

#[test]
fn the_same_scene_gives_the_same_bits() {
    let context = TestContext::new();
    let run = || {
        let fixture = Fixture::new(&context, builtin_scene("cornell-box"), Some(0.5));
        solve(&context, &fixture.linked(&context, Settings::default()), &fixture.world, 3)
    };
    let first = run();
    assert!(first == run());
    assert!(first.indirect.iter().any(|e| *e != Vec3::ZERO));
}

/// A figure that dances: linking again after a pose is the same as starting from that pose, bit by bit.
#[test]
fn everything_may_deform() {
    let context = TestContext::new();
    let scene = builtin_scene("dancer");
    let sky = Environment::Constant(Vec3::ONE);
    let settings = Settings { bins: 4, ..Settings::default() };
    let start = Pose::at(&scene, 0.0);
    let fixture = Fixture::posed(&context, scene.clone(), None, sky.clone(), &start);
    let mut method = fixture.linked(&context, settings);
    let before = solve(&context, &method, &fixture.world, 1);

    let pose = Pose::at(&scene, 0.7);
    let mut recorder = context.recorder("test").unwrap();
    fixture.world.pose(&mut recorder, &pose);
    fixture.bvh.refit(&mut recorder, &fixture.world.positions).unwrap();
    recorder.submit().unwrap();
    method.link(&context, &fixture.stage()).unwrap();
    let after = solve(&context, &method, &fixture.world, 1);

    let fresh = Fixture::posed(&context, scene, None, sky, &pose);
    let expected = solve(&context, &fresh.linked(&context, settings), &fresh.world, 1);
    assert!(after == expected, "following a pose differs from starting from it");
    assert!(before != after, "the figure did not move");
}

/// Another sky, other materials: the light of the same frame, without new links.
#[test]
fn sky_and_materials_change_without_new_links() {
    let context = TestContext::new();
    let scene = builtin_scene("dancer");
    let pose = Pose::rest(&scene);
    let settings = Settings { bins: 4, ..Settings::default() };
    let dawn = Environment::Constant(Vec3::new(1.0, 0.5, 0.25));
    let fixture = Fixture::posed(&context, scene.clone(), None, Environment::Constant(Vec3::ONE), &pose);
    let mut method = fixture.linked(&context, settings);
    let white = solve(&context, &method, &fixture.world, 2);
    method.set_environment(&context, &dawn).unwrap();
    let relit = solve(&context, &method, &fixture.world, 2);
    let other = Fixture::posed(&context, scene.clone(), None, dawn.clone(), &pose);
    assert!(relit == solve(&context, &other.linked(&context, settings), &other.world, 2));

    let mut repainted = scene;
    repainted.materials.iter_mut().for_each(|m| m.base_color *= glam::Vec4::new(0.5, 1.0, 0.1, 1.0));
    let materials: Vec<_> = repainted.materials.iter().map(|m| linklight::stages::world::material(m, true)).collect();
    context.write(&fixture.world.materials, &materials).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    method.update_materials(&mut recorder, &fixture.world);
    recorder.submit().unwrap();
    let painted = solve(&context, &method, &fixture.world, 2);
    let other = Fixture::posed(&context, repainted, None, dawn, &pose);
    assert!(painted == solve(&context, &other.linked(&context, settings), &other.world, 2));
    assert!(white != relit && relit != painted);
}
