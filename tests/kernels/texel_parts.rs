//! `atlas/part_rays` and `atlas/part_hits`, which find what lies inside of things, against plain loops.

use crate::common::scenes::{lambert, parallelogram, scene};
use crate::common::{Random, TestContext};
use crate::compare::{Tolerance, hold, tells_apart};
use crate::environment_irradiance::{basis_of, cosine_hemisphere};
use crate::texel_light::{even_point, pcg4d};
use glam::{UVec4, Vec2, Vec3};
use linklight::gpu::shaders::atlas::{PartHits, PartHitsParams, PartRays, PartRaysParams};
use linklight::gpu::shaders::types::{Hit, Ray};
use linklight::scene::Material;
use linklight::scene::environment::Environment;
use linklight::scene::geometry::Geometry;
use linklight::scene::pose::Pose;
use linklight::stages::trace::NO_HIT;
use linklight::stages::world::World;

const OFFSET: f32 = 1e-3;
const TOLERANCE: Tolerance = Tolerance { absolute: 2e-5, relative: 2e-5 };
/// Set in a hit's triangle where it was hit from behind.
const BACK_FACE: u32 = 1 << 31;

#[test]
fn rays_of_parts_are_those_of_a_plain_loop() {
    let context = TestContext::new();
    let random = &mut Random(65);
    let (first_part, batch_count, sample_count) = (2u32, 25u32, 6u32);
    let mut vector = || Vec3::new(random.unit(), random.unit(), random.unit());
    let count = (first_part + batch_count) as usize;
    let points: Vec<Vec3> = (0..count).map(|_| vector()).collect();
    // The axes and their opposites too: where a basis is hardest to find.
    let mut normals: Vec<Vec3> = (6..count).map(|_| (vector() - 0.5).normalize()).collect();
    normals.extend(Vec3::AXES.into_iter().flat_map(|axis| [axis, -axis]));
    let rays = context.buffer::<Ray>("test/rays", (batch_count * sample_count) as usize).unwrap();
    let pass = PartRays {
        points: &context.upload("test/points", &points).unwrap(),
        normals: &context.upload("test/normals", &normals).unwrap(),
        rays: &rays,
        params: PartRaysParams { first_part, batch_count, sample_count, ray_offset: OFFSET },
    };
    let mut recorder = context.recorder("test").unwrap();
    recorder.dispatch(&pass, batch_count * sample_count);
    recorder.submit().unwrap();
    let twin = |stream: u32| -> Vec<Ray> {
        let ray = |part: u32, k: u32| {
            let normal = normals[part as usize];
            let u = even_point(k, pcg4d(UVec4::new(part, stream, 0, 0)));
            let origin = points[part as usize] + OFFSET * normal;
            Ray { origin, t_min: 0.0, direction: basis_of(normal) * cosine_hemisphere(u), t_max: 3e38 }
        };
        (first_part..first_part + batch_count).flat_map(|part| (0..sample_count).map(move |k| ray(part, k))).collect()
    };
    let got = context.download(&rays).unwrap();
    hold("rays", &got, &twin(1), TOLERANCE);
    tells_apart("another stream's directions", &twin(0), &twin(1), TOLERANCE);
    for (i, ray) in got.iter().enumerate() {
        let normal = normals[first_part as usize + i / sample_count as usize];
        assert!((ray.direction.length() - 1.0).abs() < 1e-5 && ray.direction.dot(normal) > 0.0, "{ray:?}, {normal}");
    }
}

#[test]
fn only_backs_of_one_sided_surfaces_count() {
    let context = TestContext::new();
    let random = &mut Random(66);
    let one_sided = Material { double_sided: false, ..lambert(Vec3::ONE) };
    let sheet = |material| parallelogram(Vec3::ZERO, Vec3::X, Vec3::Y, 4, material);
    let scene = scene(vec![one_sided, lambert(Vec3::ONE)], vec![sheet(0), sheet(1)], &[]);
    let geometry = Geometry::flatten(&scene, 1 << 30).unwrap();
    let world = World::new(&context, &scene, &geometry, &Pose::rest(&scene), &Environment::default(), false).unwrap();
    let triangles = geometry.triangles.len() as u32;
    let (first_part, sample_count) = (3u32, 8u32);
    for batch_count in [1u32, 63, 130] {
        let hits: Vec<Hit> = (0..batch_count * sample_count)
            .map(|_| {
                let triangle = random.below(triangles) | if random.below(2) == 0 { BACK_FACE } else { 0 };
                let triangle = if random.below(4) == 0 { NO_HIT } else { triangle };
                Hit { t: 1.0, triangle, barycentrics: Vec2::splat(0.3) }
            })
            .collect();
        // Parts before the batch and after it keep what they have.
        let before = vec![99; (first_part + batch_count) as usize + 70];
        let back_hits = context.upload("test/back hits", &before).unwrap();
        let pass = PartHits {
            hits: &context.upload("test/hits", &hits).unwrap(),
            triangle_materials: &world.triangle_materials,
            materials: &world.materials,
            back_hits: &back_hits,
            params: PartHitsParams { first_part, batch_count, sample_count },
        };
        let mut recorder = context.recorder("test").unwrap();
        recorder.dispatch(&pass, batch_count);
        recorder.submit().unwrap();
        let twin = |count_both: bool| {
            let mut counts = before.clone();
            for (part, hits) in hits.chunks(sample_count as usize).enumerate() {
                let is_back = |hit: &&Hit| {
                    let part = geometry.triangle_part.get((hit.triangle & !BACK_FACE) as usize);
                    let is_one_sided = part.is_some_and(|&part| geometry.parts[part as usize].material == 0);
                    hit.triangle != NO_HIT && hit.triangle & BACK_FACE != 0 && (is_one_sided || count_both)
                };
                counts[first_part as usize + part] = hits.iter().filter(is_back).count() as u32;
            }
            counts
        };
        assert_eq!(context.download(&back_hits).unwrap(), twin(false));
        assert!(batch_count == 1 || twin(false) != twin(true), "two-sided backs would go unnoticed");
    }
}
