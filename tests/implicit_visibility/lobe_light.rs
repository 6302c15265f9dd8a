//! Light of emitters and punctual lights in the lobes of elements, and what the eye sees of them, against plain versions.

use crate::common::lobe::{brdf, diffuse_albedo, even_albedo};
use crate::common::scenes::{light, parallelogram, scene};
use crate::common::{Random, TestContext};
use crate::compare::{Tolerance, hold, tells_apart};
use crate::fixture::Fixture;
use crate::gloss_twins::{N, SIDE, TOLERANCE, color, directions_of, towards, unit_vector, widened};
use glam::{DVec3, Vec2, Vec3, Vec4};
use linklight::gpu::shaders::methods::implicit_visibility as passes;
use linklight::gpu::shaders::types::{EmitterSample, GlossTarget, LeafGloss, Light, SkySpot};
use linklight::methods::implicit_visibility::Settings;
use linklight::scene::pose::{Pose, PosedLight};
use linklight::scene::{LightKind, Material};
use linklight::stages::world::{self, World};
use std::f64::consts::PI;

/// Bright spots of the environment.
const SPOTS: usize = 35;

/// Points on emitters, punctual lights and bright spots of an environment in the lobes of elements.
#[derive(Clone)]
struct Lights {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    lobes: Vec<LeafGloss>,
    samples: Vec<EmitterSample>,
    corners: Vec<Vec3>,
    emission: Vec<Vec3>,
    visible: Vec<u32>,
    lights: Vec<PosedLight>,
    visibility: Vec<f32>,
    spots: Vec<SkySpot>,
    spots_seen: Vec<u32>,
}

impl Lights {
    fn new(count: usize, sample_count: usize, random: &mut Random) -> Self {
        let corners: Vec<Vec3> = (0..12).map(|_| Vec3::Y * 2.0 + 0.7 * unit_vector(random)).collect();
        let lights = [LightKind::Point, LightKind::Directional].map(|kind| PosedLight {
            node: 0,
            light: 0,
            position: Vec3::new(0.5, 3.0, 0.2),
            direction: Vec3::new(0.3, -0.9, 0.1).normalize(),
            kind,
            intensity: Vec3::new(1.0, 2.0, 3.0),
            range: None,
        });
        let sample = |k: u32, random: &mut Random| EmitterSample {
            triangle: random.below(4),
            barycentrics: Vec2::new(0.5 * random.unit(), 0.5 * random.unit()),
            share: 0.1 + random.unit(),
            is_double_sided: k % 2,
        };
        let words = sample_count.div_ceil(32);
        Self {
            positions: (0..count).map(|_| unit_vector(random)).collect(),
            normals: (0..count).map(|_| (Vec3::Y + 0.7 * unit_vector(random)).normalize()).collect(),
            lobes: (0..count)
                .map(|_| LeafGloss { f0: color(random), f90: 1.0, alpha: 0.1 + 0.5 * random.unit() })
                .collect(),
            samples: (0..sample_count as u32).map(|k| sample(k, random)).collect(),
            emission: corners.iter().map(|_| 3.0 * color(random)).collect(),
            visible: (0..count * words).map(|_| random.next_u64() as u32).collect(),
            visibility: (0..count * lights.len()).map(|_| random.unit()).collect(),
            lights: lights.to_vec(),
            spots: (0..SPOTS).map(|_| SkySpot { direction: unit_vector(random), irradiance: color(random) }).collect(),
            spots_seen: (0..count * SPOTS.div_ceil(32)).map(|_| random.next_u64() as u32).collect(),
            corners,
        }
    }

    fn triangles() -> Vec<[u32; 3]> {
        (0..4).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect()
    }

    fn on_device(&self, context: &TestContext, side: u32, eye: Vec4, before: &[Vec3], light_count: u32) -> Vec<Vec3> {
        let count = self.positions.len() as u32;
        let own: Vec<u32> = (0..count).collect();
        let triangles: Vec<glam::UVec3> = Self::triangles().into_iter().map(Into::into).collect();
        let table: Vec<Light> = self.lights.iter().map(world::light).collect();
        let reflected = context.upload("test/reflected", before).unwrap();
        let target = GlossTarget { side, first: 0, count };
        let identity = context.upload("test/own", &own).unwrap();
        let pass = passes::ReflectLights {
            glossy_leaves: &identity,
            leaf_elements: &identity,
            element_vertices: &identity,
            element_positions: &context.upload("test/positions", &self.positions).unwrap(),
            element_normals: &context.upload("test/normals", &self.normals).unwrap(),
            lobes: &context.upload("test/lobes", &self.lobes).unwrap(),
            samples: &context.upload("test/samples", &self.samples).unwrap(),
            triangles: &context.upload("test/triangles", &triangles).unwrap(),
            positions: &context.upload("test/corners", &self.corners).unwrap(),
            emission: &context.upload("test/emission", &self.emission).unwrap(),
            visible: &context.upload("test/visible", &self.visible).unwrap(),
            lights: &context.upload("test/lights", &table).unwrap(),
            visibility: &context.upload("test/visibility", &self.visibility).unwrap(),
            spots: &context.upload("test/spots", &self.spots).unwrap(),
            spots_seen: &context.upload("test/spots seen", &self.spots_seen).unwrap(),
            reflected: &reflected,
            params: passes::ReflectLightsParams {
                target,
                eye: eye.to_array(),
                element_count: count,
                sample_count: self.samples.len() as u32,
                light_count,
                spot_count: self.spots.len() as u32,
                bin_count: 6 * N * N,
            },
        };
        let mut recorder = context.recorder("test").unwrap();
        recorder.dispatch(&pass, before.len());
        recorder.submit().unwrap();
        context.download(&reflected).unwrap()
    }

    /// The twin of `reflect_lights`.
    fn reflected(&self, side: u32, eye: Vec4, before: &[Vec3], light_count: u32) -> Vec<Vec3> {
        let (directions, triangles) = (directions_of(side), Self::triangles());
        let words = self.samples.len().div_ceil(32);
        let each = directions.len().max(1);
        let mut out = before.to_vec();
        for (element, (&position, lobe)) in self.positions.iter().zip(&self.lobes).enumerate() {
            let normal = self.normals[element].as_dvec3();
            let value =
                |eye: DVec3, light: DVec3| brdf(lobe.f0.as_dvec3(), 1.0, widened(lobe, 6 * N * N), normal, eye, light);
            for k in 0..each {
                let to_eye = directions.get(k).copied().unwrap_or_else(|| towards(eye, position));
                let mut sum = DVec3::ZERO;
                for (index, sample) in self.samples.iter().enumerate() {
                    if self.visible[element * words + index / 32] >> (index % 32) & 1 == 0 {
                        continue;
                    }
                    let corners = triangles[sample.triangle as usize];
                    let [a, b, c] = corners.map(|v| self.corners[v as usize].as_dvec3());
                    let [la, lb, lc] = corners.map(|v| self.emission[v as usize].as_dvec3());
                    let (s, t) = (f64::from(sample.barycentrics.x), f64::from(sample.barycentrics.y));
                    let across = (b - a).cross(c - a);
                    let area = 0.5 * across.length() * f64::from(sample.share);
                    let offset = a + s * (b - a) + t * (c - a) - position.as_dvec3();
                    let (squared, direction) = (offset.length_squared(), offset.normalize());
                    let cosine = -across.normalize().dot(direction);
                    let leaving = if sample.is_double_sided != 0 { cosine.abs() } else { cosine.max(0.0) };
                    let radiance = (1.0 - s - t) * la + s * lb + t * lc;
                    let factor = normal.dot(direction).max(0.0) * leaving * area / (squared + area / PI);
                    sum += value(to_eye, direction) * radiance * factor;
                }
                for (index, light) in self.lights[..light_count as usize].iter().enumerate() {
                    let offset = (light.position - position).as_dvec3();
                    let (to_light, arriving) = match light.kind {
                        LightKind::Directional => (-light.direction.as_dvec3(), light.intensity.as_dvec3()),
                        _ => (offset.normalize(), light.intensity.as_dvec3() / offset.length_squared()),
                    };
                    let seen = f64::from(self.visibility[index * self.positions.len() + element]);
                    sum += value(to_eye, to_light) * arriving * (normal.dot(to_light).max(0.0) * seen);
                }
                for (index, spot) in self.spots.iter().enumerate() {
                    let is_seen = self.spots_seen[element * SPOTS.div_ceil(32) + index / 32] >> (index % 32) & 1 != 0;
                    let towards = spot.direction.as_dvec3();
                    let cosine = if is_seen { normal.dot(towards).max(0.0) } else { 0.0 };
                    sum += value(to_eye, towards) * spot.irradiance.as_dvec3() * cosine;
                }
                if to_eye.dot(normal) > 0.0 {
                    out[element * each + k] += sum.as_vec3();
                }
            }
        }
        out
    }
}

#[test]
fn points_on_emitters_and_lights_shine_in_lobes() {
    let context = TestContext::new();
    let random = &mut Random(5);
    for (count, sample_count) in [(1, 1), (65, 32), (70, 45)] {
        let case = Lights::new(count, sample_count, random);
        for (side, eye, light_count) in [(0, Vec4::new(0.0, 4.0, 3.0, 1.0), 0), (SIDE, Vec4::ZERO, 2)] {
            let each = if side == 0 { 1 } else { 6 * side * side };
            let before: Vec<Vec3> = (0..count * each as usize).map(|_| color(random)).collect();
            let what = format!("{count} elements, {sample_count} points, side {side}");
            let expected = case.reflected(side, eye, &before, light_count);
            hold(&what, &case.on_device(&context, side, eye, &before, light_count), &expected, TOLERANCE);
            if count > 1 {
                tells_apart(
                    "light not added up",
                    &case.reflected(side, eye, &vec![Vec3::ZERO; before.len()], light_count),
                    &expected,
                    TOLERANCE,
                );
                tells_apart(
                    "one light more",
                    &case.reflected(side, eye, &before, 2 - light_count / 2),
                    &expected,
                    TOLERANCE,
                );
                let blind = Lights {
                    visible: case.visible.iter().map(|bits| !bits).collect(),
                    ..Lights::new(count, sample_count, &mut Random(1))
                };
                let dark = Lights { spots_seen: vec![0; case.spots_seen.len()], ..case.clone() };
                tells_apart("no spots", &dark.reflected(side, eye, &before, light_count), &expected, TOLERANCE);
                tells_apart(
                    "other points seen",
                    &blind.reflected(side, eye, &before, light_count),
                    &expected,
                    TOLERANCE,
                );
            }
        }
    }
}

#[test]
fn what_the_display_reflects_evenly_is_what_the_lobe_sends() {
    let context = TestContext::new();
    let random = &mut Random(4);
    let count = 130u32;
    let case = Lights::new(count as usize, 1, random);
    let own: Vec<u32> = (0..count).collect();
    let glossy: Vec<u32> = own.iter().copied().filter(|leaf| leaf % 3 != 1).collect();
    let albedo: Vec<Vec3> = own.iter().map(|_| 0.5 * color(random)).collect();
    let irradiance: Vec<Vec3> = own.iter().map(|_| color(random)).collect();
    let to_eye: Vec<Vec3> = glossy.iter().map(|_| color(random)).collect();
    let identity = context.upload("test/own", &own).unwrap();
    for eye in [Vec4::new(0.0, 5.0, 1.0, 1.0), Vec4::new(0.0, 0.8, 0.6, 0.0)] {
        let shown = context.upload("test/shown", &irradiance).unwrap();
        let pass = passes::ShowGlossy {
            glossy_leaves: &context.upload("test/glossy", &glossy).unwrap(),
            leaf_elements: &identity,
            element_vertices: &identity,
            element_positions: &context.upload("test/positions", &case.positions).unwrap(),
            element_normals: &context.upload("test/normals", &case.normals).unwrap(),
            albedo: &context.upload("test/albedo", &albedo).unwrap(),
            irradiance: &context.upload("test/irradiance", &irradiance).unwrap(),
            lobes: &context.upload("test/lobes", &case.lobes).unwrap(),
            to_eye: &context.upload("test/to eye", &to_eye).unwrap(),
            shown: &shown,
            params: passes::ShowGlossyParams { eye: eye.to_array(), glossy_count: glossy.len() as u32 },
        };
        let mut recorder = context.recorder("test").unwrap();
        recorder.dispatch(&pass, glossy.len());
        recorder.submit().unwrap();
        let twin = |to_eye: &[Vec3]| {
            let mut shown = irradiance.clone();
            for (&leaf, sent) in glossy.iter().zip(to_eye) {
                let (lobe, diffuse) = (&case.lobes[leaf as usize], albedo[leaf as usize].as_dvec3());
                let cos_eye = towards(eye, case.positions[leaf as usize]).dot(case.normals[leaf as usize].as_dvec3());
                let (f0, alpha) = (lobe.f0.as_dvec3(), widened(lobe, 1_000_000_000));
                let own = diffuse_albedo(diffuse, f0, 1.0, cos_eye) * irradiance[leaf as usize].as_dvec3();
                let even = even_albedo(diffuse, f0, 1.0, alpha, cos_eye).max(DVec3::splat(1e-4));
                shown[leaf as usize] = ((own + PI * sent.as_dvec3()) / even).as_vec3();
            }
            shown
        };
        hold("show_glossy", &context.download(&shown).unwrap(), &twin(&to_eye), TOLERANCE);
        let mut moved = to_eye.clone();
        moved.rotate_left(1);
        tells_apart("another leaf's lobe", &twin(&moved), &twin(&to_eye), TOLERANCE);
    }
}

/// Metal of many colours beside a dielectric: vertices have the mean of the triangles around them, by area.
#[test]
fn lobes_are_averaged_over_the_triangles_around() {
    let context = TestContext::new();
    let random = &mut Random(2);
    let metal = Material { metallic: 1.0, roughness: 0.4, double_sided: true, ..Material::default() };
    let dull = Material { metallic: 0.0, roughness: 0.9, ..metal.clone() };
    let mut parts = vec![
        parallelogram(Vec3::ZERO, Vec3::X, Vec3::Z, 3, 0),
        parallelogram(Vec3::new(3.0, 0.0, 0.0), Vec3::X, Vec3::Z, 2, 1),
    ];
    for part in &mut parts {
        part.colors.iter_mut().for_each(|c| *c = color(random).extend(1.0));
        part.positions.iter_mut().for_each(|p| *p += 0.1 * unit_vector(random));
    }
    let room = scene(vec![metal, dull], parts, &[(light(LightKind::Point, 1.0), Vec3::Y, Vec3::NEG_Y)]);
    let pose = Pose::rest(&room);
    let mut fixture = Fixture::new(&context, room, None);
    fixture.world =
        World::new(&context, &fixture.scene, &fixture.geometry, &pose, &fixture.environment, false).unwrap();
    let method = fixture.linked(&context, Settings { bins: 2, glossy: 0.0, ..Settings::default() });
    let (geometry, positions) = (&fixture.geometry, &fixture.rest_positions);
    let twin = |is_even: bool| {
        let lobe = |vertex: u32| {
            let (mut f0, mut alpha, mut area_sum) = (Vec3::ZERO, 0.0, 0.0);
            for (triangle, corners) in geometry.triangles.iter().enumerate().filter(|(_, t)| t.contains(&vertex)) {
                let [a, b, c] = corners.map(|v| positions[v as usize]);
                let area = if is_even { 1.0 } else { (b - a).cross(c - a).length() };
                let weight = |v: u32| if v == vertex { 22.0 / 36.0 } else { 7.0 / 36.0 };
                let own: Vec4 = corners.iter().map(|&v| weight(v) * geometry.colors[v as usize]).sum();
                let is_metal = geometry.parts[geometry.triangle_part[triangle] as usize].material == 0;
                f0 += area * if is_metal { own.truncate() } else { Vec3::splat(0.04) };
                alpha += area * if is_metal { 0.16 } else { 0.81 };
                area_sum += area;
            }
            LeafGloss { f0: f0 / area_sum, f90: 1.0, alpha: alpha / area_sum }
        };
        (0..positions.len() as u32).map(lobe).collect::<Vec<_>>()
    };
    let tolerance = Tolerance { absolute: 1e-6, relative: 1e-5 };
    hold("vertex_gloss", &context.download(method.lobes()).unwrap(), &twin(false), tolerance);
    tells_apart("areas left out", &twin(true), &twin(false), tolerance);
}
