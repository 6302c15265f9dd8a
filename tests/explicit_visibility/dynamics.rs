//! What moves, what must not differ, and what must stay dark.

use crate::common::TestContext;
use crate::common::scenes::{lambert, light, parallelogram, scene};
use crate::fixture::{Fixture, builtin_scene, solve};
use glam::{Quat, Vec3};
use linklight::methods::explicit_visibility::Settings;
use linklight::scene::environment::Environment;
use linklight::scene::pose::Pose;
use linklight::scene::{LightKind, Material, Node, Scene, Transform};
use linklight::stages::elements::BACK_SIDE;

#[test]
fn behind_a_closed_door_it_is_exactly_dark() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("two-rooms"), Some(0.8));
    let method = fixture.prepare(&context, Settings::default());
    let solution = solve(&context, &method, &fixture.world, 4);
    let (mut lit, mut dark) = (0, 0);
    for (element, position) in fixture.rest_positions.iter().enumerate() {
        let light = solution.direct[element] + solution.indirect[element];
        if position.x > 0.0 {
            assert_eq!(light, Vec3::ZERO, "element {element} at {position}");
            dark += 1;
        } else if light.min_element() > 0.0 {
            lit += 1;
        }
    }
    println!(
        "two-rooms: {lit} of {} elements of the lit room have light, {dark} are dark; {:?}",
        fixture.rest_positions.len() - dark,
        method.report()
    );
    assert!(lit * 10 > 8 * (fixture.rest_positions.len() - dark) && dark > 300);
}

#[test]
fn the_same_scene_gives_the_same_bits() {
    let context = TestContext::new();
    let run = |_: u32| {
        let fixture = Fixture::new(&context, builtin_scene("cornell-box"), Some(0.5));
        let method = fixture.prepare(&context, Settings { rotate_rays: true, ..Settings::default() });
        let solution = solve(&context, &method, &fixture.world, 3);
        (solution.direct, solution.indirect)
    };
    let (first, second) = (run(1), run(2));
    assert!(first == second);
    assert!(first.1.iter().any(|e| *e != Vec3::ZERO));
}

/// Each bounce: what leaves all elements arrives at others, or escapes.                              [common ground]
#[test]
fn each_bounce_keeps_the_balance_of_power() {
    let context = TestContext::new();
    for (name, max_edge) in [("cornell-box", 0.4), ("furnace", 0.5)] {
        let fixture = Fixture::new(&context, builtin_scene(name), Some(max_edge));
        let method = fixture.prepare(&context, Settings::default());
        let elements = method.elements();
        let [albedo, area] = [
            context.download(&elements.albedo).unwrap(),
            context.download(&elements.area).unwrap().into_iter().map(Vec3::splat).collect(),
        ];
        let counts = context.download(&method.outcomes().counts).unwrap();
        let mut sent_before = None;
        for bounce in 0..=4 {
            let arriving = solve(&context, &method, &fixture.world, bounce).last;
            let power = |share: &dyn Fn(usize) -> Vec3| {
                (0..arriving.len()).map(|e| (area[e] * share(e) * arriving[e]).element_sum() as f64).sum::<f64>()
            };
            let received = power(&|_| Vec3::ONE);
            let absorbed = power(&|e| Vec3::ONE - albedo[e]);
            // Reciprocity: of what an element sends, the share that meets something is that of its rays that do.
            let kept = |e: usize| 1.0 - ((counts[e] & 0xffff) + (counts[e] >> 16)) as f32 / 256.0;
            let sent = power(&|e| albedo[e] * kept(e));
            if let Some(sent_before) = sent_before {
                let imbalance: f64 = received / sent_before - 1.0;
                println!(
                    "{name}, bounce {bounce}: received {received:.3} W of {sent_before:.3} W, absorbed {absorbed:.3} W, imbalance {:.2} %",
                    100.0 * imbalance
                );
                assert!(imbalance.abs() < 0.03, "{name}, bounce {bounce}: {imbalance}");
            }
            sent_before = Some(sent);
        }
    }
}

/// A sheet lit from above only: its back sees the floor's reflected light, none of the lamp's.
#[test]
fn the_two_sides_of_a_sheet_are_lit_apart() {
    let context = TestContext::new();
    let sheet = parallelogram(Vec3::new(-1.0, 1.0, 1.0), Vec3::X * 2.0, Vec3::NEG_Z * 2.0, 4, 0);
    let floor = parallelogram(Vec3::new(-4.0, 0.0, 4.0), Vec3::X * 8.0, Vec3::NEG_Z * 8.0, 16, 1);
    let lamp = (light(LightKind::Point, 10.0), Vec3::new(0.0, 3.0, 0.0), Vec3::NEG_Y);
    let materials = vec![lambert(Vec3::splat(0.5)), Material { double_sided: false, ..lambert(Vec3::splat(0.8)) }];
    let fixture = Fixture::new(&context, scene(materials, vec![sheet, floor], &[lamp]), None);
    let method = fixture.prepare(&context, Settings::default());
    let solution = solve(&context, &method, &fixture.world, 1);
    assert_eq!((method.report().elements, method.report().back_elements), (25 * 2 + 289, 25));
    for (element, &entry) in method.elements().topology.vertices.iter().enumerate() {
        let (punctual, indirect) = (solution.punctual[element].x, solution.indirect[element].x);
        if entry & BACK_SIDE != 0 {
            assert!(punctual == 0.0 && indirect > 0.0, "back {element}: {punctual}, {indirect}");
        } else if entry < 25 {
            assert!(punctual > 0.0 && indirect == 0.0, "front {element}: {punctual}, {indirect}");
        }
    }
    // The floor under the sheet gets nothing at the first bounce from the sheet's dark back.
    let under = method.elements().topology.vertices.len() - 25 - 289 / 2 - 1;
    assert_eq!(fixture.rest_positions[under], Vec3::ZERO);
    assert_eq!((solution.punctual[under], solution.indirect[under]), (Vec3::ZERO, Vec3::ZERO));
}

/// Where a block stands on the floor, the floor inside it looks from where its triangles come out from below the block, and
/// takes the light of the floor around it where they do not.
#[test]
fn elements_inside_things_take_their_neighbours_light() {
    let context = TestContext::new();
    let wall = |corner: [f32; 3], u: Vec3, v: Vec3| parallelogram(Vec3::from(corner), u, v, 1, 0);
    let block = [
        wall([-1.0, -0.5, 1.0], Vec3::X * 2.0, Vec3::Y),
        wall([1.0, -0.5, -1.0], Vec3::NEG_X * 2.0, Vec3::Y),
        wall([1.0, -0.5, 1.0], Vec3::NEG_Z * 2.0, Vec3::Y),
        wall([-1.0, -0.5, -1.0], Vec3::Z * 2.0, Vec3::Y),
        wall([-1.0, 0.5, 1.0], Vec3::X * 2.0, Vec3::NEG_Z * 2.0),
    ];
    let floor = parallelogram(Vec3::new(-3.0, 0.0, 3.0), Vec3::X * 6.0, Vec3::NEG_Z * 6.0, 8, 0);
    let material = Material { double_sided: false, ..lambert(Vec3::splat(0.5)) };
    let primitives = block.into_iter().chain([floor]).collect();
    let sky = Environment::Constant(Vec3::ONE);
    let fixture = Fixture::posed(&context, scene(vec![material], primitives, &[]), None, sky, Pose::rest);
    let method = fixture.prepare(&context, Settings::default());
    let solution = solve(&context, &method, &fixture.world, 2);
    let report = method.report();
    println!("{report:?}");
    let counts = context.download(&method.outcomes().counts).unwrap();
    let is_unresolved = |element: &usize| (counts[*element] & 0xffff) * 2 > report.rays as u32 / report.elements;
    let unresolved: Vec<Vec3> =
        (20..counts.len()).filter(is_unresolved).map(|element| fixture.rest_positions[element]).collect();
    // Of nine floor vertices that are inside, the middle one has no triangle that comes out.
    assert_eq!(unresolved, [Vec3::ZERO], "{report:?}");
    for (element, position) in fixture.rest_positions.iter().enumerate().skip(20) {
        let edge = position.x.abs().max(position.z.abs());
        if edge <= 0.75 && position.y == 0.0 {
            assert!(solution.direct[element].x > 0.5, "{position}: {}", solution.direct[element]);
        }
    }
}

/// Moves through `poses` by refitting and following, and compares with a fresh start in each.
fn assert_followed(context: &TestContext, scene: impl Fn() -> Scene, poses: &[&dyn Fn(&Scene) -> Pose]) {
    let moved = Fixture::new(context, scene(), Some(0.5));
    let mut method = moved.prepare(context, Settings::default());
    let mut solutions: Vec<Vec<Vec3>> = Vec::new();
    for (index, pose) in poses.iter().enumerate() {
        let mut recorder = context.recorder("test").unwrap();
        moved.world.pose(&mut recorder, &pose(&moved.scene));
        moved.bvh.refit(&mut recorder, &moved.world.positions).unwrap();
        recorder.submit().unwrap();
        method.follow(context, &moved.stage()).unwrap();
        let followed = solve(context, &method, &moved.world, 2);

        let fixture = Fixture::posed(context, scene(), Some(0.5), Environment::default(), pose);
        let fresh_method = fixture.prepare(context, Settings::default());
        let fresh = solve(context, &fresh_method, &fixture.world, 2);
        // To the bit: hits do not depend on the tree, since of several at one distance the lowest triangle counts.
        assert_eq!(method.links().link_count, fresh_method.links().link_count, "pose {index}");
        assert!(followed.punctual == fresh.punctual, "pose {index}: punctual");
        assert!(followed.direct == fresh.direct, "pose {index}: direct");
        assert!(followed.indirect == fresh.indirect, "pose {index}: indirect");
        assert!(solutions.iter().all(|earlier| *earlier != followed.indirect), "pose {index}: it moves");
        solutions.push(followed.indirect);
    }
}

/// The rest pose with one node elsewhere.
fn with_node(scene: &Scene, node: usize, transform: Transform) -> Pose {
    let mut elsewhere = scene.clone();
    elsewhere.nodes[node].transform = transform;
    Pose::rest(&elsewhere)
}

#[test]
fn a_moved_block_and_lamp_are_lit_as_from_a_fresh_start() {
    let context = TestContext::new();
    let scene = || {
        let mut scene = builtin_scene("cornell-box");
        scene.lights.push(light(LightKind::Point, 5.0));
        scene.nodes.push(Node { light: Some(0), ..Node::default() });
        scene
    };
    let block = scene().nodes.iter().position(|node| node.name == "tall box").unwrap();
    let lamp = scene().nodes.len() - 1;
    let turned = |angle: f32, x: f32| Transform::Trs {
        translation: Vec3::new(x, 0.3, -0.2),
        rotation: Quat::from_rotation_y(angle),
        scale: Vec3::new(1.0, 0.8, 1.0),
    };
    assert_followed(
        &context,
        scene,
        &[
            &|scene| with_node(scene, lamp, turned(0.0, 2.0)),
            &|scene| with_node(scene, block, turned(0.2, 0.4)),
            &|scene| with_node(scene, block, turned(-0.3, -0.1)),
        ],
    );
}

/// Skin and clip: every element moves.
#[test]
fn the_dancer_is_lit_alike_by_refit_and_from_a_fresh_start() {
    let context = TestContext::new();
    let at = |seconds: f32| move |scene: &Scene| Pose::at(scene, seconds);
    assert_followed(&context, || builtin_scene("dancer"), &[&at(0.3), &at(0.9), &at(2.0)]);
}
