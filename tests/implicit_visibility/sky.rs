//! A plane under a sky with a box on it: direct light against rays, by bins alone.

use crate::common::scenes::{lambert, one_sided_box, parallelogram, scene};
use crate::common::{Random, TestContext};
use crate::fixture::{Fixture, solve, winners};
use crate::twins;
use glam::{Quat, Vec2, Vec3};
use linklight::gpu::shaders::types::{Ray, Receiver};
use linklight::methods::implicit_visibility::{Settings, bins};
use linklight::scene::environment::{Environment, EnvironmentMap};
use linklight::scene::pose::Pose;
use linklight::stages::trace::{self, Tracer};
use std::f32::consts::PI;

/// Brighter towards one side and the top.
fn sky() -> EnvironmentMap {
    let (width, height) = (64, 32);
    let blank = EnvironmentMap { width, height, texels: Vec::new(), rotation: 0.0 };
    let texel = |i: u32| {
        let at = Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5) / Vec2::new(width as f32, height as f32);
        let towards = blank.direction_of(at);
        Vec3::new(0.2, 0.3, 0.5) + 2.0 * towards.dot(Vec3::new(0.6, 0.8, 0.0)).max(0.0).powi(4)
    };
    EnvironmentMap { texels: (0..width * height).map(texel).collect(), ..blank }
}

#[test]
fn the_sky_around_a_box_is_seen_the_better_the_more_bins() {
    let context = TestContext::new();
    let mut parts = one_sided_box(Vec3::new(-0.6, 0.0, -0.6), Vec3::new(0.6, 1.2, 0.6), 5);
    parts.push(parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, 16, 0));
    let material = linklight::scene::Material { double_sided: false, ..lambert(Vec3::splat(0.5)) };
    let room = scene(vec![material], parts, &[]);
    let map = sky();
    let fixture = Fixture::posed(&context, room, None, Environment::Map(map.clone()), Pose::rest);

    // The reference: rays drawn by the cosine about each sampled element.
    const RAYS: usize = 4096;
    let probe = fixture.linked(&context, Settings { bins: 2, ..Settings::default() });
    let receivers = context.download(&probe.linking().receivers).unwrap();
    // Those of the plane below the box take light from their neighbours.
    let is_covered = |at: &Receiver| at.origin.y < 0.01 && at.normal.y > 0.5 && at.origin.abs().max_element() < 0.7;
    let sampled: Vec<usize> = (0..receivers.len()).step_by(11).filter(|&leaf| !is_covered(&receivers[leaf])).collect();
    let mut random = Random(3);
    let mut rays = Vec::new();
    for &leaf in &sampled {
        let at = &receivers[leaf];
        let to_world = Quat::from_rotation_arc(Vec3::Z, at.normal);
        for _ in 0..RAYS {
            let (radius, phi) = (random.unit().sqrt(), 2.0 * PI * random.unit());
            let local = Vec3::new(radius * phi.cos(), radius * phi.sin(), (1.0 - radius * radius).sqrt());
            rays.push(Ray { origin: at.origin, t_min: 0.0, direction: to_world * local, t_max: f32::MAX });
        }
    }
    let (buffer, free) = (context.upload("rays", &rays).unwrap(), context.buffer::<u32>("free", rays.len()).unwrap());
    let mut recorder = context.recorder("test").unwrap();
    trace::any_hit(&mut recorder, &Tracer::compute(&fixture.bvh, &fixture.world), &buffer, &free, rays.len());
    recorder.submit().unwrap();
    let is_free = context.download(&free).unwrap();
    let arriving = |k: usize| if is_free[k] != 0 { map.radiance(rays[k].direction) } else { Vec3::ZERO };
    let reference: Vec<Vec3> = (0..sampled.len())
        .map(|s| (s * RAYS..(s + 1) * RAYS).map(arriving).sum::<Vec3>() * (PI / RAYS as f32))
        .collect();
    let scale = reference.iter().map(|e| e.length_squared()).sum::<f32>() / reference.len() as f32;

    let error = |n: u32| {
        let method =
            fixture.linked(&context, Settings { bins: n, smoothing: false, sky_spots: 0, ..Settings::default() });
        let direct = solve(&context, &method, &fixture.world, 0).direct;
        let (vectors, seen) = (bins::vectors(n), bins::radiance(&fixture.environment, n));
        let rows = winners(&context, &method);
        let mut sum = 0.0;
        for (&leaf, expected) in sampled.iter().zip(&reference) {
            let found = direct[method.trees().topology.leaf_elements[leaf] as usize];
            sum += (found - *expected).length_squared();
            // The pass against its twin: the sky through the empty bins.
            let weights = twins::weights(receivers[leaf].normal, &vectors);
            let empty = rows[leaf].iter().zip(&weights).zip(&seen).filter(|((winner, _), _)| **winner == twins::EMPTY);
            let twin: glam::DVec3 = empty.map(|((_, weight), radiance)| radiance.as_dvec3() * *weight).sum();
            assert!((found.as_dvec3() - twin).length() < 1e-4 * (twin.length() + 1e-3), "{found} for {twin}");
        }
        let error = sum / sampled.len() as f32 / scale;
        println!("N = {n}: relative MSE {error:.2e}");
        error
    };
    let errors = [4, 8, 16].map(error);
    assert!(errors[1] < 0.6 * errors[0] && errors[2] < 0.8 * errors[1] && errors[2] < 1e-3, "{errors:?}");
}
