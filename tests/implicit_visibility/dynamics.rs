//! What moves, and what must not differ.

use crate::common::TestContext;
use crate::fixture::{Fixture, Solution, builtin_scene, solve};
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

/// What surrounds a dancing figure shimmers as bins see it or miss it: how much, by bins and frames.
#[test]
fn shimmer_around_a_dancer_falls_with_the_bins() {
    let context = TestContext::new();
    let scene = builtin_scene("dancer");
    let sky = Environment::Constant(Vec3::ONE);
    let times = [0.50, 0.52, 0.54];
    let fixture = Fixture::posed(&context, scene.clone(), None, sky, &Pose::at(&scene, times[0]));
    let shimmer_of = |settings: Settings| {
        let mut method = fixture.linked(&context, settings);
        let solutions: Vec<Solution> = times
            .iter()
            .map(|&time| {
                let mut recorder = context.recorder("test").unwrap();
                fixture.world.pose(&mut recorder, &Pose::at(&scene, time));
                recorder.submit().unwrap();
                method.link(&context, &fixture.stage()).unwrap();
                solve(&context, &method, &fixture.world, 0)
            })
            .collect();
        // Second differences: what is left when all that changes evenly is taken away. Still elements alone.
        let mut sum = 0.0;
        let mut count = 0;
        let positions = context.download(&fixture.world.positions).unwrap();
        for (element, position) in fixture.rest_positions.iter().enumerate() {
            if (positions[element] - *position).length() > 1e-4 {
                continue;
            }
            count += 1;
            for k in 1..times.len() - 1 {
                let at = |k: usize| solutions[k].direct[element].x;
                sum += f64::from(at(k + 1) - 2.0 * at(k) + at(k - 1)).powi(2);
            }
        }
        assert!(count > 100, "{count} still elements");
        let shimmer = (sum / f64::from(count)).sqrt();
        println!("N = {}, {:?}: shimmer {shimmer:.5} of {count} still elements", settings.bins, settings.frames);
        shimmer
    };
    let coarse = shimmer_of(Settings { bins: 4, ..Settings::default() });
    shimmer_of(Settings { bins: 4, frames: Frames::Surface, ..Settings::default() });
    let fine = shimmer_of(Settings { bins: 10, ..Settings::default() });
    assert!(fine > 0.0 && fine < 0.7 * coarse, "{fine} {coarse}");
}
