//! `arriving_light/*` against sums over rays in plain words.

use crate::common::{Random, TestContext};
use crate::compare::{Tolerance, hold, tells_apart};
use crate::punctual_irradiance::{arriving, lights};
use glam::{UVec3, Vec2, Vec3};
use linklight::gpu::shaders::arriving_light as passes;
use linklight::gpu::shaders::types::{ArrivingLight, AtlasTexel, Hit, Ray};
use linklight::gpu::{Context, Sampled};
use linklight::scene::environment::Environment;
use linklight::scene::pose::PosedLight;
use linklight::stages::world::{self, WorldEnvironment};
use std::f32::consts::PI;

/// Sums of some tens of products.
const TOLERANCE: Tolerance = Tolerance { absolute: 1e-5, relative: 1e-5 };
const NO_HIT: u32 = u32::MAX;
const BACK_FACE: u32 = 1 << 31;

fn direction(random: &mut Random) -> Vec3 {
    (Vec3::new(random.unit(), random.unit(), random.unit()) * 2.0 - 1.0).normalize_or(Vec3::X)
}

fn add(sum: &mut ArrivingLight, irradiance: Vec3, direction: Vec3) {
    sum.constant += (0.25 / PI).sqrt() * irradiance;
    let linear = (0.75 / PI).sqrt() * irradiance;
    sum.along_y += direction.y * linear;
    sum.along_z += direction.z * linear;
    sum.along_x += direction.x * linear;
}

fn nothing() -> ArrivingLight {
    ArrivingLight { constant: Vec3::ZERO, along_y: Vec3::ZERO, along_z: Vec3::ZERO, along_x: Vec3::ZERO }
}

/// Three triangles of six vertices, the last two of which have backs.
struct Surfaces {
    rays: Vec<Ray>,
    hits: Vec<Hit>,
    triangles: Vec<UVec3>,
    back_elements: Vec<u32>,
    exitant: Vec<Vec3>,
    environment: Vec3,
    samples: u32,
}

impl Surfaces {
    fn new(texels: u32, samples: u32, random: &mut Random) -> Self {
        let ray =
            |random: &mut Random| Ray { origin: Vec3::ZERO, t_min: 0.0, direction: direction(random), t_max: 1.0 };
        let hit = |random: &mut Random| {
            let triangle = match random.below(5) {
                0 => NO_HIT,
                side => random.below(3) | if side == 1 { BACK_FACE } else { 0 },
            };
            let u = random.unit();
            Hit { t: 1.0, triangle, barycentrics: Vec2::new(u, (1.0 - u) * random.unit()) }
        };
        Self {
            rays: (0..texels * samples).map(|_| ray(random)).collect(),
            hits: (0..texels * samples).map(|_| hit(random)).collect(),
            triangles: vec![UVec3::new(0, 1, 2), UVec3::new(2, 1, 3), UVec3::new(3, 4, 5)],
            back_elements: vec![NO_HIT, NO_HIT, NO_HIT, 6, 7, 8],
            exitant: (0..9).map(|_| Vec3::new(random.unit(), random.unit(), random.unit())).collect(),
            environment: Vec3::new(0.5, 1.0, 2.0),
            samples,
        }
    }

    fn twin(&self, has_environment: bool) -> Vec<ArrivingLight> {
        let radiance = |hit: &Hit| {
            if hit.triangle == NO_HIT {
                return if has_environment { self.environment } else { Vec3::ZERO };
            }
            let corners = self.triangles[(hit.triangle & !BACK_FACE) as usize].to_array();
            let is_back = hit.triangle & BACK_FACE != 0;
            let elements = corners.map(|v| if is_back { self.back_elements[v as usize] } else { v });
            if elements.contains(&NO_HIT) {
                return Vec3::ZERO;
            }
            let [a, b, c] = elements.map(|element| self.exitant[element as usize]);
            (1.0 - hit.barycentrics.x - hit.barycentrics.y) * a + hit.barycentrics.x * b + hit.barycentrics.y * c
        };
        let texel = |(rays, hits): (&[Ray], &[Hit])| {
            let mut sum = nothing();
            for (ray, hit) in rays.iter().zip(hits) {
                add(&mut sum, 2.0 * PI / self.samples as f32 * radiance(hit), ray.direction);
            }
            sum
        };
        self.rays.chunks(self.samples as usize).zip(self.hits.chunks(self.samples as usize)).map(texel).collect()
    }

    fn on_device(&self, context: &Context, has_environment: bool) -> Vec<ArrivingLight> {
        let tables = WorldEnvironment::new(context, &Environment::Constant(self.environment)).unwrap();
        let texels = self.rays.len() as u32 / self.samples;
        let arriving = context.upload("test/arriving", &vec![nothing(); texels as usize]).unwrap();
        let pass = passes::Surfaces {
            rays: &context.upload("test/rays", &self.rays).unwrap(),
            hits: &context.upload("test/hits", &self.hits).unwrap(),
            triangles: &context.upload("test/triangles", &self.triangles).unwrap(),
            back_elements: &context.upload("test/back elements", &self.back_elements).unwrap(),
            exitant: &context.upload("test/exitant", &self.exitant).unwrap(),
            environment_info: &tables.info_buffer,
            environment_map: Sampled { image: &tables.map, sampler: &tables.sampler },
            arriving: &arriving,
            params: passes::SurfacesParams {
                first_texel: 0,
                batch_count: texels,
                sample_count: self.samples,
                has_environment: has_environment.into(),
            },
        };
        let mut recorder = context.recorder("test").unwrap();
        recorder.dispatch(&pass, texels);
        recorder.submit().unwrap();
        context.download(&arriving).unwrap()
    }
}

#[test]
fn light_from_surfaces_agrees_with_its_twin() {
    let context = TestContext::new();
    let random = &mut Random(31);
    for (texels, samples) in [(0, 4), (1, 1), (63, 8), (65, 17)] {
        let case = Surfaces::new(texels, samples, random);
        for has_environment in [false, true] {
            let got = case.on_device(&context, has_environment);
            hold(&format!("{texels} x {samples}"), &got, &case.twin(has_environment), TOLERANCE);
        }
    }
    let case = Surfaces::new(65, 17, random);
    let expected = case.twin(true);
    tells_apart("no environment", &case.twin(false), &expected, TOLERANCE);
    let one_sided = Surfaces { back_elements: vec![NO_HIT; 6], ..case };
    tells_apart("black backs", &one_sided.twin(true), &expected, TOLERANCE);
}

/// The twin of one light over all its shadow rays.
fn light(described: &PosedLight, rays: &[Ray], is_free: &[u32], samples: usize) -> Vec<ArrivingLight> {
    let texel = |(rays, is_free): (&[Ray], &[u32])| {
        let mut sum = nothing();
        for (ray, _) in rays.iter().zip(is_free).filter(|(ray, free)| ray.t_max >= 0.0 && **free != 0) {
            let (irradiance, to_light) = arriving(described, ray.origin);
            add(&mut sum, irradiance / samples as f32, to_light);
        }
        sum
    };
    rays.chunks(samples).zip(is_free.chunks(samples)).map(texel).collect()
}

#[test]
fn punctual_light_agrees_with_its_twin() {
    let context = TestContext::new();
    let random = &mut Random(32);
    let described = lights(random);
    let lights: Vec<_> = described.iter().map(world::light).collect();
    let (texels, samples) = (65u32, 6u32);
    let rays: Vec<Ray> = (0..texels * samples)
        .map(|i| Ray {
            origin: 0.5 * direction(random),
            t_min: 0.0,
            direction: Vec3::Y,
            t_max: if i % 5 == 0 { -1.0 } else { 1.0 },
        })
        .collect();
    let is_free: Vec<u32> = rays.iter().map(|_| random.below(2)).collect();
    for (index, described) in described.iter().enumerate() {
        let arriving = context.upload("test/arriving", &vec![nothing(); texels as usize]).unwrap();
        let pass = passes::Light {
            lights: &context.upload("test/lights", &lights).unwrap(),
            rays: &context.upload("test/rays", &rays).unwrap(),
            is_free: &context.upload("test/is free", &is_free).unwrap(),
            arriving: &arriving,
            params: passes::LightParams {
                first_texel: 0,
                batch_count: texels,
                sample_count: samples,
                light: index as u32,
            },
        };
        let mut recorder = context.recorder("test").unwrap();
        recorder.dispatch(&pass, texels);
        recorder.submit().unwrap();
        let expected = light(described, &rays, &is_free, samples as usize);
        let tolerance = Tolerance { absolute: 5e-5, relative: 5e-5 };
        hold(&format!("light {index}"), &context.download(&arriving).unwrap(), &expected, tolerance);
        let all_free = light(described, &rays, &vec![1; is_free.len()], samples as usize);
        if expected.iter().any(|sum| sum.constant != Vec3::ZERO) {
            tells_apart("shadows", &all_free, &expected, tolerance);
        }
    }
}

/// Rays fill the hemisphere evenly: their mean is half the normal, their mean height's square a third.
#[test]
fn rays_fill_the_hemisphere() {
    let context = TestContext::new();
    let random = &mut Random(33);
    let texels: Vec<AtlasTexel> = (0..65)
        .map(|_| {
            let normal = direction(random);
            let (u, v) = normal.any_orthonormal_pair();
            let position = 3.0 * direction(random);
            AtlasTexel { position, normal, side_u: 0.1 * u, side_v: 0.2 * v, first_part: 0, part_count: 1, is_back: 0 }
        })
        .collect();
    let samples = 256u32;
    let rays = context.buffer("test/rays", texels.len() * samples as usize).unwrap();
    let params = passes::RaysParams {
        first_texel: 0,
        batch_count: texels.len() as u32,
        sample_count: samples,
        seed: 7,
        ray_offset: 0.01,
    };
    let mut recorder = context.recorder("test").unwrap();
    let pass = passes::Rays { texels: &context.upload("test/texels", &texels).unwrap(), rays: &rays, params };
    recorder.dispatch(&pass, texels.len() as u32 * samples);
    recorder.submit().unwrap();
    let rays: Vec<Ray> = context.download(&rays).unwrap();
    for (texel, rays) in texels.iter().zip(rays.chunks(samples as usize)) {
        let mean: Vec3 = rays.iter().map(|ray| ray.direction).sum::<Vec3>() / samples as f32;
        assert!(mean.abs_diff_eq(0.5 * texel.normal, 0.02), "{mean} for half of {}", texel.normal);
        let squares: f32 = rays.iter().map(|ray| ray.direction.dot(texel.normal).powi(2)).sum();
        assert!((squares / samples as f32 - 1.0 / 3.0).abs() < 0.01);
        for ray in rays {
            let offset = ray.origin - texel.position;
            assert!(ray.direction.is_normalized() && ray.direction.dot(texel.normal) >= -1e-6);
            assert!((offset.dot(texel.normal) - 0.01).abs() < 1e-5 && offset.length() < 0.13);
        }
    }
}
