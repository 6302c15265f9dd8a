//! What moves, and what must not differ.

use crate::common::TestContext;
use crate::common::scenes::{lambert, light, one_sided_box, parallelogram, scene};
use crate::fixture::{Fixture, builtin_scene, solve};
use glam::Vec3;
use linklight::methods::implicit_visibility::Settings;
use linklight::scene::environment::Environment;
use linklight::scene::pose::Pose;
use linklight::scene::{LightKind, Material, Scene};

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

/// A box on a plane, and a lamp beside it.
fn box_and_lamp() -> Scene {
    let mut parts = one_sided_box(Vec3::new(-0.6, 0.0, -0.6), Vec3::new(0.6, 1.2, 0.6), 4);
    parts.push(parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, 12, 0));
    let lamp = (light(LightKind::Point, 5.0), Vec3::new(1.5, 2.0, 0.5), Vec3::NEG_Y);
    scene(vec![Material { double_sided: false, ..lambert(Vec3::splat(0.5)) }], parts, &[lamp])
}

/// A figure that dances: linking again after a pose is the same as starting from that pose, bit by bit.
#[test]
fn everything_may_deform() {
    let context = TestContext::new();
    let scene = builtin_scene("dancer");
    let sky = Environment::Constant(Vec3::ONE);
    let settings = Settings { bins: 2, ..Settings::default() };
    let start = Pose::at(&scene, 0.0);
    let fixture = Fixture::posed(&context, scene.clone(), None, sky.clone(), |_| start.clone());
    let mut method = fixture.linked(&context, settings);
    let before = solve(&context, &method, &fixture.world, 1);

    let pose = Pose::at(&scene, 0.7);
    let mut recorder = context.recorder("test").unwrap();
    fixture.world.pose(&mut recorder, &pose);
    fixture.bvh.refit(&mut recorder, &fixture.world.positions).unwrap();
    recorder.submit().unwrap();
    method.link(&context, &fixture.stage()).unwrap();
    let after = solve(&context, &method, &fixture.world, 1);

    let fresh = Fixture::posed(&context, scene, None, sky, |_| pose.clone());
    let expected = solve(&context, &fresh.linked(&context, settings), &fresh.world, 1);
    assert!(after == expected, "following a pose differs from starting from it");
    assert!(before != after, "the figure did not move");
}

/// Another sky, other materials: the light of the same frame, without new links.
#[test]
fn sky_and_materials_change_without_new_links() {
    let context = TestContext::new();
    let scene = box_and_lamp();
    let settings = Settings { bins: 4, ..Settings::default() };
    let dawn = Environment::Constant(Vec3::new(1.0, 0.5, 0.25));
    let fixture = Fixture::posed(&context, scene.clone(), None, Environment::Constant(Vec3::ONE), Pose::rest);
    let mut method = fixture.linked(&context, settings);
    let white = solve(&context, &method, &fixture.world, 2);
    method.set_environment(&context, &dawn).unwrap();
    let relit = solve(&context, &method, &fixture.world, 2);
    let other = Fixture::posed(&context, scene.clone(), None, dawn.clone(), Pose::rest);
    assert!(relit == solve(&context, &other.linked(&context, settings), &other.world, 2));

    let mut repainted = scene;
    repainted.materials.iter_mut().for_each(|m| m.base_color *= glam::Vec4::new(0.5, 1.0, 0.1, 1.0));
    let materials: Vec<_> = repainted.materials.iter().map(|m| linklight::stages::world::material(m, true)).collect();
    context.write(&fixture.world.materials, &materials).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    method.update_materials(&mut recorder, &fixture.world);
    recorder.submit().unwrap();
    let painted = solve(&context, &method, &fixture.world, 2);
    let other = Fixture::posed(&context, repainted, None, dawn, Pose::rest);
    assert!(painted == solve(&context, &other.linked(&context, settings), &other.world, 2));
    assert!(white != relit && relit != painted);
}

/// A light that dims shows at once; one that moves, with the frame's links.
#[test]
fn a_punctual_light_changes_in_the_same_frame() {
    let context = TestContext::new();
    let scene = box_and_lamp();
    let sky = Environment::default();
    let settings = Settings { bins: 4, ..Settings::default() };
    let mut pose = Pose::rest(&scene);
    let fixture = Fixture::posed(&context, scene.clone(), None, sky.clone(), Pose::rest);
    let mut method = fixture.linked(&context, settings);
    let before = solve(&context, &method, &fixture.world, 1);
    let follow = |pose: &Pose| {
        let mut recorder = context.recorder("test").unwrap();
        fixture.world.pose(&mut recorder, pose);
        recorder.submit().unwrap();
    };
    let fresh = |pose: &Pose| {
        let other = Fixture::posed(&context, scene.clone(), None, sky.clone(), |_| pose.clone());
        solve(&context, &other.linked(&context, settings), &other.world, 1)
    };

    pose.lights[0].intensity *= Vec3::new(0.5, 2.0, 0.0);
    follow(&pose);
    let dimmed = solve(&context, &method, &fixture.world, 1);
    assert!(dimmed != before && dimmed == fresh(&pose), "another colour needs no new links");

    pose.lights[0].position += Vec3::new(1.5, -0.5, 0.0);
    follow(&pose);
    method.link(&context, &fixture.stage()).unwrap();
    let moved = solve(&context, &method, &fixture.world, 1);
    assert!(moved != dimmed && moved == fresh(&pose), "its shadows move with it");
}

/// Light on what stands still while the figure dances, frame by frame: how much of it trembles.
struct Trembling {
    /// Root mean square of the light's second differences from frame to frame, as noise of each frame, of the mean light.
    noise: f64,
    /// And of the difference between the first and the last frame.
    change: f64,
}

fn trembling(context: &TestContext, settings: impl Fn(usize) -> Settings) -> Trembling {
    const FRAMES: usize = 3;
    let scene = builtin_scene("dancer");
    let pose = |frame: usize| Pose::at(&scene, 1.0 + frame as f32 / 30.0);
    let fixture = Fixture::posed(context, scene.clone(), None, Environment::default(), |_| pose(0));
    let mut method = fixture.linked(context, settings(0));
    let mut is_still = vec![true; fixture.geometry.vertex_count() as usize];
    let first = context.download(&fixture.world.positions).unwrap();
    let mut frames: Vec<Vec<f64>> = Vec::new();
    for frame in 0..FRAMES {
        let mut recorder = context.recorder("test").unwrap();
        fixture.world.pose(&mut recorder, &pose(frame));
        fixture.bvh.refit(&mut recorder, &fixture.world.positions).unwrap();
        recorder.submit().unwrap();
        if settings(frame) == settings(0) {
            method.link(context, &fixture.stage()).unwrap();
        } else {
            method = fixture.linked(context, settings(frame));
        }
        let light = solve(context, &method, &fixture.world, 1);
        let positions = context.download(&fixture.world.positions).unwrap();
        is_still.iter_mut().zip(first.iter().zip(&positions)).for_each(|(still, (a, b))| *still &= a == b);
        let sums = light.direct.iter().zip(&light.indirect).map(|(a, b)| f64::from((*a + *b).element_sum()));
        frames.push(sums.collect());
    }
    let vertices = &method.elements().topology.vertices;
    let still: Vec<usize> = (0..vertices.len())
        .filter(|&element| is_still[(vertices[element] & !linklight::stages::elements::BACK_SIDE) as usize])
        .collect();
    assert!(still.len() > 1000 && still.len() < vertices.len(), "{} of {} stand still", still.len(), vertices.len());
    let mean = still.iter().map(|&e| frames[0][e]).sum::<f64>() / still.len() as f64;
    let squares = still.iter().flat_map(|&e| {
        let frames = &frames;
        (1..FRAMES - 1).map(move |k| (frames[k - 1][e] - 2.0 * frames[k][e] + frames[k + 1][e]).powi(2))
    });
    // Independent noise of variance v has second differences of variance 6 v; steady motion has next to none.
    let noise = (squares.sum::<f64>() / (still.len() * (FRAMES - 2)) as f64 / 6.0).sqrt() / mean;
    let changes = still.iter().map(|&e| (frames[FRAMES - 1][e] - frames[0][e]).powi(2));
    Trembling { noise, change: (changes.sum::<f64>() / still.len() as f64).sqrt() / mean }
}

#[test]
fn what_stands_still_trembles_little_while_the_figure_dances() {
    let context = TestContext::new();
    let of = |what: &str, settings: &dyn Fn(usize) -> Settings| {
        let found = trembling(&context, settings);
        println!("{what}: noise {:.2e} of the mean light, change over all frames {:.2e}", found.noise, found.change);
        found
    };
    let still = Settings { bins: 3, smoothing: false, ..Settings::default() };
    let world = of("N = 3", &|_| still);
    let finer = of("N = 5", &|_| Settings { bins: 5, ..still });
    // Bins that turn from frame to frame: what the figure would see of noise.
    let turned = of("N = 3, turned by 7 degrees a frame", &|frame| Settings { spin: 7.0 * frame as f32, ..still });
    assert!(world.noise < 0.02 && finer.noise < world.noise, "{} {}", world.noise, finer.noise);
    assert!(turned.noise > 2.0 * world.noise, "the measure is blind: {} for {}", turned.noise, world.noise);
}
