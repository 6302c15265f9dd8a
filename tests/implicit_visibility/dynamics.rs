//! What moves, and what must not differ.

use crate::common::TestContext;
use crate::fixture::{Fixture, builtin_scene, solve};
use glam::Vec3;
use linklight::methods::implicit_visibility::{Frames, Settings};
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

/// Light on what stands still while a figure moves: how much more it changes from frame to frame than in many bins, in the
/// world's bins, in bins along the surface, and averaged over turned bins.
#[test]
fn turning_the_bins_and_averaging_calms_what_surrounds_a_dancer() {
    let context = TestContext::new();
    let room = builtin_scene("dancer");
    let times = [0.50, 0.54, 0.58];
    let fixture =
        Fixture::posed(&context, room.clone(), None, Environment::Constant(Vec3::ONE), &Pose::at(&room, times[0]));
    let changes = |bins: u32, frames: Frames, spins: &[f32]| {
        let mut frames_of_light = Vec::new();
        let mut moved = vec![false; fixture.rest_positions.len()];
        for time in times {
            let mut recorder = context.recorder("test").unwrap();
            fixture.world.pose(&mut recorder, &Pose::at(&room, time));
            recorder.submit().unwrap();
            let mut mean = vec![Vec3::ZERO; 0];
            for &spin in spins {
                let settings = Settings { bins, frames, spin, smoothing: false, ..Settings::default() };
                let method = fixture.linked(&context, settings);
                let direct = solve(&context, &method, &fixture.world, 0).direct;
                mean.resize(direct.len(), Vec3::ZERO);
                mean.iter_mut().zip(&direct).for_each(|(sum, light)| *sum += *light / spins.len() as f32);
            }
            let positions = context.download(&fixture.world.positions).unwrap();
            for ((moved, now), rest) in moved.iter_mut().zip(&positions).zip(&fixture.rest_positions) {
                *moved |= now.distance(*rest) > 1e-4;
            }
            frames_of_light.push(mean);
        }
        // Second differences: what is left when all that changes evenly is taken away. Still elements alone.
        let still: Vec<usize> = (0..moved.len()).filter(|&e| !moved[e]).collect();
        let second = |e: usize| frames_of_light[2][e].x - 2.0 * frames_of_light[1][e].x + frames_of_light[0][e].x;
        still.iter().map(|&e| second(e)).collect::<Vec<f32>>()
    };
    let truth = changes(16, Frames::World, &[0.0]);
    let flicker = |frames: Frames, spins: &[f32]| {
        let own = changes(4, frames, spins);
        let mean = own.iter().zip(&truth).map(|(a, b)| (a - b).abs()).sum::<f32>() / own.len() as f32;
        println!("{frames:?}, {} turns: {mean:.5} W/m2 on {} still elements", spins.len(), own.len());
        mean
    };
    let world = flicker(Frames::World, &[0.0]);
    let surface = flicker(Frames::Surface, &[0.0]);
    let turned = flicker(Frames::World, &[0.0, 17.0, 31.0]);
    assert!(world > 0.0 && surface > 0.0 && turned < 0.9 * world, "{world} {surface} {turned}");
}
