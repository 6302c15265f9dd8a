//! Animation against closed forms, node hierarchy, skinning and morphing by hand.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::{Mat4, Quat, Vec3, Vec4};
use linklight::scene::animation::unplayed_channels;
use linklight::scene::deform::{normal_matrix, world_vertices};
use linklight::scene::geometry::Geometry;
use linklight::scene::pose::{Pose, PoseLayout};
use linklight::scene::*;
use proptest::prelude::*;

use crate::made::{assert_near, primitive, scene_of, square};

const BUDGET: u64 = 1 << 30;

fn animated(channels: Vec<Channel>, duration: f32) -> Scene {
    let clips = vec![Clip { name: "clip".into(), duration, channels }];
    Scene { nodes: vec![Node::default()], clips, ..Default::default() }
}

fn channel(interpolation: Interpolation, times: &[f32], track: Track) -> Channel {
    Channel { node: 0, interpolation, times: times.to_vec(), track }
}

fn origin(scene: &Scene, seconds: f32) -> Vec3 {
    Pose::at(scene, seconds).world_from_node[0].w_axis.truncate()
}

#[test]
fn step_holds_each_key_until_the_next() {
    let track = Track::Translation(vec![Vec3::X, Vec3::Y, Vec3::Z]);
    let scene = animated(vec![channel(Interpolation::Step, &[1.0, 2.0, 3.0], track)], 10.0);
    for (seconds, expected) in
        [(0.0, Vec3::X), (1.0, Vec3::X), (1.999, Vec3::X), (2.0, Vec3::Y), (3.0, Vec3::Z), (9.0, Vec3::Z)]
    {
        assert_eq!(origin(&scene, seconds), expected, "at {seconds} s");
    }
}

#[test]
fn linear_mixes_clamps_and_loops() {
    let track = Track::Translation(vec![Vec3::ZERO, Vec3::new(4.0, 0.0, 2.0)]);
    let scene = animated(vec![channel(Interpolation::Linear, &[1.0, 3.0], track)], 5.0);
    assert_eq!(origin(&scene, 0.5), Vec3::ZERO);
    assert_near(origin(&scene, 1.5), Vec3::new(1.0, 0.0, 0.5), 1e-6);
    assert_eq!(origin(&scene, 4.5), Vec3::new(4.0, 0.0, 2.0));
    assert_near(origin(&scene, 6.5), origin(&scene, 1.5), 1e-6);
    assert_near(origin(&scene, -3.5), origin(&scene, 1.5), 1e-6);
    assert_eq!(origin(&scene, f32::NAN), origin(&scene, 0.0));
}

#[test]
fn linear_rotation_takes_the_short_way_round() {
    let (a, b) = (Quat::IDENTITY, -Quat::from_rotation_z(FRAC_PI_2));
    let scene = animated(vec![channel(Interpolation::Linear, &[0.0, 1.0], Track::Rotation(vec![a, b]))], 2.0);
    for step in 0..=10 {
        let t = step as f32 / 10.0;
        let expected = Quat::from_rotation_z(FRAC_PI_2 * t) * Vec3::X;
        assert_near(Pose::at(&scene, t).world_from_node[0].transform_vector3(Vec3::X), expected, 2e-6);
    }
}

#[test]
fn cubic_spline_reproduces_a_cubic() {
    // Hermite interpolation is exact for cubics: x(t) = t^3 - 2 t^2 + 3, tangents per second.
    let x = |t: f32| t * t * t - 2.0 * t * t + 3.0;
    let slope = |t: f32| 3.0 * t * t - 4.0 * t;
    let times = [0.0, 0.5, 2.0];
    let keys = times.iter().flat_map(|&t| [slope(t), x(t), slope(t)].map(|v| Vec3::new(v, -v, 0.0)));
    let track = Track::Translation(keys.collect());
    let scene = animated(vec![channel(Interpolation::CubicSpline, &times, track)], 3.0);
    for step in 0..=25 {
        let t = step as f32 * 0.1;
        let clamped = x(t.min(2.0));
        assert_near(origin(&scene, t), Vec3::new(clamped, -clamped, 0.0), 1e-5);
    }
}

#[test]
fn cubic_spline_rotation_is_normalised() {
    let zero = Quat::from_xyzw(0.0, 0.0, 0.0, 0.0);
    let keys = vec![zero, Quat::IDENTITY, zero, zero, Quat::from_rotation_y(2.0), zero];
    let scene = animated(vec![channel(Interpolation::CubicSpline, &[0.0, 1.0], Track::Rotation(keys))], 2.0);
    for step in 0..=10 {
        let matrix = Pose::at(&scene, step as f32 / 10.0).world_from_node[0];
        assert!((matrix.determinant() - 1.0).abs() < 1e-5);
    }
    // By symmetry half way in time is half way in angle.
    let half = Pose::at(&scene, 0.5).world_from_node[0].transform_vector3(Vec3::Z);
    assert_near(half, Quat::from_rotation_y(1.0) * Vec3::Z, 1e-6);
}

#[test]
fn morph_weights_are_sampled_per_target_in_every_mode() {
    let mut morphed = square();
    morphed.morph_targets = vec![MorphTarget::default(); 2];
    let base = scene_of(morphed);
    let cases = [
        (Interpolation::Step, vec![0.0, 1.0, 1.0, 3.0], [0.0, 1.0]),
        (Interpolation::Linear, vec![0.0, 1.0, 1.0, 3.0], [0.25, 1.5]),
        // Per key: in-tangents, values, out-tangents. With zero tangents t = 1/4 gives 3 t^2 - 2 t^3 = 0.15625.
        (Interpolation::CubicSpline, vec![0., 0., 0., 1., 0., 0., 0., 0., 1., 3., 0., 0.], [0.15625, 1.3125]),
    ];
    for (interpolation, weights, expected) in cases {
        let mut scene = base.clone();
        let track = Track::MorphWeights { target_count: 2, weights };
        scene.clips = vec![Clip {
            name: String::new(),
            duration: 4.0,
            channels: vec![channel(interpolation, &[0.0, 2.0], track)],
        }];
        assert_eq!(Pose::at(&scene, 0.5).morph_weights, expected, "{interpolation:?}");
    }
}

#[test]
fn an_earlier_clip_wins_and_is_noted_once() {
    let track = |value| Track::Translation(vec![value]);
    let mut scene = animated(vec![channel(Interpolation::Step, &[0.0], track(Vec3::X))], 1.0);
    scene.clips.push(Clip {
        name: "second".into(),
        duration: 1.0,
        channels: vec![
            channel(Interpolation::Step, &[0.0], track(Vec3::Y)),
            channel(Interpolation::Step, &[0.0], Track::Scale(vec![Vec3::splat(2.0)])),
        ],
    });
    let world = Pose::at(&scene, 0.0).world_from_node[0];
    assert_eq!(world, Mat4::from_scale_rotation_translation(Vec3::splat(2.0), Quat::IDENTITY, Vec3::X));
    let notes = unplayed_channels(&scene);
    assert_eq!(notes.len(), 1);
    assert!(notes[0].contains("second") && notes[0].contains("translation"), "{}", notes[0]);
}

#[test]
fn lights_and_cameras_follow_their_nodes_unscaled() {
    let trs = |translation, rotation, scale| Transform::Trs { translation, rotation, scale };
    let scene = Scene {
        nodes: vec![
            Node { transform: trs(Vec3::Y, Quat::from_rotation_y(PI), Vec3::splat(5.0)), ..Default::default() },
            Node {
                parent: Some(0),
                transform: trs(Vec3::X, Quat::IDENTITY, Vec3::ONE),
                light: Some(0),
                camera: Some(0),
                ..Default::default()
            },
        ],
        lights: vec![Light { name: "l".into(), kind: LightKind::Point, intensity: Vec3::ONE, range: Some(2.0) }],
        cameras: vec![Camera {
            name: "c".into(),
            projection: Projection::Perspective { fov_y: 1.0, near: 0.1, far: None },
        }],
        ..Default::default()
    };
    let pose = Pose::rest(&scene);
    assert_near(pose.lights[0].position, Vec3::new(-5.0, 1.0, 0.0), 1e-5);
    assert_near(pose.lights[0].direction, Vec3::Z, 1e-6);
    assert_eq!((pose.lights[0].node, pose.cameras[0].node), (1, 1));
    assert_eq!(pose.cameras[0].world_from_camera, pose.world_from_node[1]);
}

/// A bar along +Y held by two joints: the lower stays, the upper turns about (0, 1, 0).
fn bar() -> Scene {
    let mut bar = primitive(vec![Vec3::ZERO, Vec3::new(0.5, 1.0, 0.0), Vec3::new(0.0, 2.0, 0.0)], vec![[0, 1, 2]]);
    bar.normals = vec![Vec3::X; 3];
    bar.joints = vec![[0, 1, 0, 0, 0, 0, 0, 0]; 3];
    bar.joint_weights =
        [[1.0, 0.0], [0.5, 0.5], [0.0, 1.0]].map(|[a, b]| [a, b, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]).to_vec();
    let mut scene = scene_of(bar);
    // The mesh's own node is far away: a skinned vertex must ignore it.
    scene.nodes[0].transform = Transform::Matrix(Mat4::from_translation(Vec3::splat(100.0)));
    scene.nodes[0].skin = Some(0);
    scene.nodes.push(Node::default());
    scene.nodes.push(Node {
        parent: Some(1),
        transform: Transform::Trs { translation: Vec3::Y, rotation: Quat::IDENTITY, scale: Vec3::ONE },
        ..Default::default()
    });
    scene.skins =
        vec![Skin { joints: vec![1, 2], inverse_bind: vec![Mat4::IDENTITY, Mat4::from_translation(Vec3::NEG_Y)] }];
    let turn = Channel {
        node: 2,
        interpolation: Interpolation::Linear,
        times: vec![0.0, 1.0],
        track: Track::Rotation(vec![Quat::IDENTITY, Quat::from_rotation_z(FRAC_PI_2)]),
    };
    scene.clips = vec![Clip { name: "bend".into(), duration: 2.0, channels: vec![turn] }];
    scene
}

#[test]
fn two_joints_skin_by_hand() {
    let scene = bar();
    let geometry = Geometry::flatten(&scene, BUDGET).unwrap();
    let rest = world_vertices(&geometry, &Pose::rest(&scene));
    assert_eq!(rest.positions, geometry.local_positions);

    let bent = world_vertices(&geometry, &Pose::at(&scene, 1.0));
    // The top turns by 90 degrees about (0, 1, 0): (0, 2, 0) goes to (-1, 1, 0).
    assert_near(bent.positions[0], Vec3::ZERO, 1e-6);
    assert_near(bent.positions[2], Vec3::new(-1.0, 1.0, 0.0), 1e-6);
    // The middle is the mean of staying (0.5, 1, 0) and turning (0, 1.5, 0).
    assert_near(bent.positions[1], Vec3::new(0.25, 1.25, 0.0), 1e-6);
    assert_near(bent.normals[0], Vec3::X, 1e-6);
    assert_near(bent.normals[2], Vec3::Y, 1e-6);
    // The mean of the two matrices has columns (1,1,0)/2, (-1,1,0)/2: its inverse transpose turns X by 45 degrees.
    assert_near(bent.normals[1], Vec3::new(1.0, 1.0, 0.0).normalize(), 1e-6);
}

#[test]
fn skin_instances_share_palette_and_morphs_do_not() {
    let mut scene = bar();
    scene.meshes[0].primitives[0].morph_targets = vec![MorphTarget::default()];
    scene.nodes.push(Node { mesh: Some(0), skin: Some(0), morph_weights: vec![0.5], ..Default::default() });
    let layout = PoseLayout::of(&scene);
    assert_eq!((layout.palette_count, layout.total_weight_count), (2, 2));
    let geometry = Geometry::flatten(&scene, BUDGET).unwrap();
    assert_eq!(geometry.parts.len(), 2);
    assert_eq!(geometry.skin_joints[0], geometry.skin_joints[3]);
    assert_eq!(geometry.parts.iter().map(|part| part.morph_weight_offset).collect::<Vec<_>>(), [0, 1]);
    assert_eq!(Pose::rest(&scene).morph_weights, [0.0, 0.5]);
}

#[test]
fn morph_then_node_transform() {
    let mut morphed = square();
    let up = MorphTarget { positions: vec![Vec3::Z; 4], normals: vec![Vec3::X; 4], tangents: vec![] };
    morphed.morph_targets = vec![up, MorphTarget { positions: vec![Vec3::X; 4], ..Default::default() }];
    let mut scene = scene_of(morphed);
    scene.nodes[0].morph_weights = vec![1.0, 0.5];
    scene.nodes[0].transform =
        Transform::Trs { translation: Vec3::Y, rotation: Quat::IDENTITY, scale: Vec3::new(2.0, 1.0, 1.0) };
    let geometry = Geometry::flatten(&scene, BUDGET).unwrap();
    let world = world_vertices(&geometry, &Pose::rest(&scene));
    assert_near(world.positions[0], Vec3::new(1.0, 1.0, 1.0), 1e-6);
    // (1, 0, 1) under the inverse transpose of scale (2, 1, 1).
    assert_near(world.normals[0], Vec3::new(0.5, 0.0, 1.0).normalize(), 1e-6);
}

proptest! {
    #[test]
    fn normals_stay_perpendicular_to_the_surface(
        scale in prop::array::uniform3(prop_oneof![0.1f32..3.0, -3.0f32..-0.1]),
        angles in prop::array::uniform3(-3.0f32..3.0),
        shear in -1.0f32..1.0,
    ) {
        let turn = Quat::from_euler(glam::EulerRot::XYZ, angles[0], angles[1], angles[2]);
        let mut linear = glam::Mat3::from_quat(turn) * glam::Mat3::from_diagonal(scale.into());
        linear.y_axis += shear * linear.x_axis;
        let (u, v) = (Vec3::new(1.0, 2.0, -0.5), Vec3::new(-0.3, 0.4, 1.0));
        let normal = (normal_matrix(linear) * u.cross(v)).normalize();
        prop_assert!(normal.dot((linear * u).normalize()).abs() < 1e-4);
        prop_assert!(normal.dot((linear * v).normalize()).abs() < 1e-4);
        // The outside stays outside, mirrored or not: a vector leaving by the front still does.
        prop_assert!(normal.dot(linear * u.cross(v)) > 0.0);
    }

    #[test]
    fn damaged_tracks_never_panic(
        count in 0usize..7,
        key_count in 0usize..4,
        target_count in 0usize..5,
        node in 0u32..3,
        seconds in prop::num::f32::ANY,
        mode in 0usize..3,
    ) {
        let interpolation = [Interpolation::Step, Interpolation::Linear, Interpolation::CubicSpline][mode];
        let times: Vec<f32> = (0..key_count).map(|key| key as f32).collect();
        let mut morphed = square();
        morphed.morph_targets = vec![MorphTarget::default(); 2];
        let mut scene = scene_of(morphed);
        scene.nodes[0].transform = Transform::Matrix(Mat4::from_scale(Vec3::new(1.0, 0.0, 1.0)));
        let channels = [
            Track::Translation(vec![Vec3::MAX; count]),
            Track::Rotation(vec![Quat::from_vec4(Vec4::ZERO); count]),
            Track::MorphWeights { target_count, weights: vec![f32::MAX; count] },
        ].map(|track| Channel { node, interpolation, times: times.clone(), track });
        scene.clips = vec![Clip { name: String::new(), duration: 1.5, channels: channels.to_vec() }];
        let pose = Pose::at(&scene, seconds);
        prop_assert_eq!((pose.world_from_node.len(), pose.morph_weights.len()), (1, 2));
    }
}
