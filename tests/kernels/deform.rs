//! `world/deform` against `scene::deform`: rigid, flat, mirrored, skinned, morphed, and all of it at once, over time.

use crate::common::{Random, TestContext};
use crate::compare::{Tolerance, hold, tells_apart};
use glam::{Mat4, Quat, Vec3};
use linklight::gpu::Context;
use linklight::scene::deform::{WorldVertices, world_vertices};
use linklight::scene::environment::Environment;
use linklight::scene::geometry::Geometry;
use linklight::scene::pose::Pose;
use linklight::scene::{
    Channel, Clip, Interpolation, Material, Mesh, MorphTarget, Node, Primitive, Scene, Skin, Track, Transform,
};
use linklight::stages::world::World;

/// Coordinates stay below 10 m; a vertex sums at most 8 joints of 4 products each: 40 roundings of 2^-24 x 10 m.
const POSITIONS: Tolerance = Tolerance { absolute: 3e-5, relative: 0.0 };
/// Unit vectors out of products of well-conditioned matrices: some tens of roundings.
const DIRECTIONS: Tolerance = Tolerance { absolute: 2e-5, relative: 0.0 };

fn vector(random: &mut Random) -> Vec3 {
    Vec3::new(random.unit(), random.unit(), random.unit()) * 2.0 - 1.0
}

fn unit(random: &mut Random) -> Vec3 {
    loop {
        let candidate = vector(random);
        if (0.1..=1.0).contains(&candidate.length()) {
            return candidate.normalize();
        }
    }
}

/// `count` vertices strewn over -1..1 with everything a vertex can have.
fn primitive(count: usize, targets: usize, joints: usize, random: &mut Random) -> Primitive {
    let mut made = Primitive::default();
    for _ in 0..count {
        let normal = unit(random);
        made.positions.push(vector(random));
        made.normals.push(normal);
        let handedness = if random.below(2) == 0 { 1.0 } else { -1.0 };
        made.tangents.push(normal.any_orthonormal_vector().extend(handedness));
        if joints > 0 {
            // One to eight joints; unused slots name any joint at weight 0.
            let used = 1 + random.below(8) as usize;
            let weights: Vec<f32> = (0..8).map(|k| if k < used { 0.1 + random.unit() } else { 0.0 }).collect();
            let sum: f32 = weights.iter().sum();
            made.joint_weights.push(std::array::from_fn(|k| weights[k] / sum));
            made.joints.push(std::array::from_fn(|_| random.below(joints as u32) as u16));
        }
    }
    for _ in 0..targets {
        made.morph_targets.push(MorphTarget {
            positions: (0..count).map(|_| vector(random)).collect(),
            normals: (0..count).map(|_| 0.3 * vector(random)).collect(),
            tangents: (0..count).map(|_| 0.3 * vector(random)).collect(),
        });
    }
    let count = count as u32;
    made.triangles = (0..count).map(|i| [i, (i + 1) % count, (i + 2) % count]).collect();
    made
}

fn placed(translation: Vec3, angle: f32, scale: Vec3) -> Transform {
    Transform::Trs { translation, rotation: Quat::from_axis_angle(Vec3::new(0.6, 0.0, 0.8), angle), scale }
}

fn channel(node: u32, track: Track) -> Channel {
    Channel { node, interpolation: Interpolation::Linear, times: vec![0.0, 1.0], track }
}

/// Four joints of moderate angles (a blend of opposite ones would have no direction), all scaled by `scale`.
fn skin(scene: &mut Scene, scale: Vec3, random: &mut Random) -> u32 {
    let mut skin = Skin::default();
    for joint in 0..4 {
        let node = scene.nodes.len() as u32;
        let transform = placed(vector(random), 0.5 * random.unit(), scale);
        scene.nodes.push(Node { transform, ..Node::default() });
        skin.joints.push(node);
        skin.inverse_bind.push(Mat4::from_translation(0.2 * vector(random)));
        let turned = Quat::from_axis_angle(unit(random), 0.6);
        let moved = vector(random);
        scene.clips[0].channels.push(match joint % 2 {
            0 => channel(node, Track::Rotation(vec![Quat::IDENTITY, turned])),
            _ => channel(node, Track::Translation(vec![Vec3::ZERO, moved])),
        });
    }
    scene.skins.push(skin);
    scene.skins.len() as u32 - 1
}

/// Nodes of every kind, each with its own mesh of `count` vertices.
fn zoo(count: usize, seed: u64) -> Scene {
    let random = &mut Random(seed);
    let mut scene = Scene { materials: vec![Material::default()], ..Scene::default() };
    scene.clips.push(Clip { duration: 2.0, ..Clip::default() });
    if count == 0 {
        return scene;
    }
    let upright = skin(&mut scene, Vec3::ONE, random);
    let mirrored = skin(&mut scene, Vec3::new(-0.7, 1.2, 0.9), random);
    let kinds: [(Transform, usize, Option<u32>); 8] = [
        (placed(Vec3::new(1.0, -2.0, 3.0), 0.7, Vec3::new(0.5, 1.5, 2.0)), 0, None),
        (placed(Vec3::X, 2.0, Vec3::new(-1.0, 1.0, 1.0)), 0, None),
        (placed(Vec3::Y, 1.0, Vec3::new(1.0, 0.0, 1.0)), 0, None),
        (placed(Vec3::Z, -1.0, Vec3::ONE), 2, None),
        (Transform::default(), 0, Some(upright)),
        (Transform::default(), 0, Some(mirrored)),
        (placed(Vec3::X, 1.0, Vec3::splat(2.0)), 3, Some(upright)),
        (placed(Vec3::X, 1.0, Vec3::splat(2.0)), 1, Some(mirrored)),
    ];
    for (transform, targets, skin) in kinds {
        let node = scene.nodes.len() as u32;
        let mut primitive = primitive(count, targets, if skin.is_some() { 4 } else { 0 }, random);
        let is_flat = matches!(transform, Transform::Trs { scale, .. } if scale.y == 0.0);
        if is_flat {
            // What is left of a direction must be long enough to be one.
            for (normal, tangent) in primitive.normals.iter_mut().zip(&mut primitive.tangents) {
                *normal = (*normal + Vec3::Y * normal.y.signum()).normalize();
                *tangent = normal.any_orthonormal_vector().extend(tangent.w);
            }
        }
        let mesh = Some(scene.meshes.len() as u32);
        // A parent, so that world transforms are products.
        let parent = (skin.is_none() && targets == 0 && node > 8).then(|| node - 1);
        scene.meshes.push(Mesh { primitives: vec![primitive], ..Mesh::default() });
        scene.nodes.push(Node { transform, mesh, skin, parent, ..Node::default() });
        if targets > 0 {
            // The first target stays at weight 0 for the first half: it is skipped, not added.
            let weights = (0..2 * targets).map(|k| if k == 0 { 0.0 } else { random.unit() }).collect();
            scene.clips[0].channels.push(channel(node, Track::MorphWeights { target_count: targets, weights }));
        }
    }
    scene
}

fn deformed(world: &World, context: &Context) -> WorldVertices {
    let tangents: Vec<[f32; 4]> = context.download(&world.tangents).unwrap();
    WorldVertices {
        positions: context.download(&world.positions).unwrap(),
        normals: context.download(&world.normals).unwrap(),
        tangents: tangents.into_iter().map(Into::into).collect(),
    }
}

fn hold_vertices(what: &str, got: &WorldVertices, expected: &WorldVertices) {
    hold(&format!("{what}, positions"), &got.positions, &expected.positions, POSITIONS);
    hold(&format!("{what}, normals"), &got.normals, &expected.normals, DIRECTIONS);
    hold(&format!("{what}, tangents"), &got.tangents, &expected.tangents, DIRECTIONS);
}

#[test]
fn deform_agrees_with_its_twin_at_every_time() {
    let context = TestContext::new();
    for (count, seed) in [(0, 1), (1, 2), (8, 3), (63, 4), (64, 5), (65, 6), (1009, 7)] {
        let scene = zoo(count, seed);
        let geometry = Geometry::flatten(&scene, 1 << 30).unwrap();
        let rest = Pose::rest(&scene);
        let world = World::new(&context, &scene, &geometry, &rest, &Environment::default(), false).unwrap();
        hold_vertices(
            &format!("{count} vertices a part at rest"),
            &deformed(&world, &context),
            &world_vertices(&geometry, &rest),
        );
        let mut earlier = None;
        for seconds in [0.0, 0.4, 0.9] {
            let pose = Pose::at(&scene, seconds);
            let mut recorder = context.recorder("test").unwrap();
            world.pose(&mut recorder, &pose);
            recorder.submit().unwrap();
            let twin = world_vertices(&geometry, &pose);
            hold_vertices(&format!("{count} vertices a part at {seconds} s"), &deformed(&world, &context), &twin);
            if let (Some(earlier), true) = (earlier, count > 0) {
                let earlier: WorldVertices = earlier;
                tells_apart("a pose that was not uploaded", &earlier.positions, &twin.positions, POSITIONS);
                tells_apart("normals that did not turn", &earlier.normals, &twin.normals, DIRECTIONS);
                tells_apart("tangents that did not turn", &earlier.tangents, &twin.tangents, DIRECTIONS);
            }
            earlier = Some(twin);
        }
    }
}

/// Normals are directions: a skin in nanometres or in light-seconds has them as well.
#[test]
fn skins_of_extreme_scale_keep_their_normals() {
    let context = TestContext::new();
    for scale in [1e-12f32, 1e-6, 1e6, 1e11] {
        let random = &mut Random(9);
        let mut scene = Scene { materials: vec![Material::default()], ..Scene::default() };
        scene.clips.push(Clip::default());
        let skin = skin(&mut scene, Vec3::new(-scale, scale, scale), random);
        let mut primitive = primitive(65, 0, 4, random);
        primitive.positions.iter_mut().for_each(|position| *position /= scale);
        scene.skins[0].inverse_bind = vec![Mat4::IDENTITY; 4];
        scene.meshes.push(Mesh { primitives: vec![primitive], ..Mesh::default() });
        scene.nodes.push(Node { mesh: Some(0), skin: Some(skin), ..Node::default() });
        let geometry = Geometry::flatten(&scene, 1 << 30).unwrap();
        let rest = Pose::rest(&scene);
        let world = World::new(&context, &scene, &geometry, &rest, &Environment::default(), false).unwrap();
        hold_vertices(&format!("scale {scale:e}"), &deformed(&world, &context), &world_vertices(&geometry, &rest));
    }
}
