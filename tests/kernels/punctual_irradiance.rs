//! `elements/punctual_irradiance` and `lib/light.glsl` against KHR_lights_punctual in plain words.

use crate::common::{Random, TestContext};
use crate::compare::{Tolerance, hold, tells_apart};
use glam::Vec3;
use linklight::gpu::Context;
use linklight::gpu::shaders::elements::{PunctualIrradiance, PunctualIrradianceParams};
use linklight::gpu::shaders::types::Light;
use linklight::scene::LightKind;
use linklight::scene::pose::PosedLight;
use linklight::stages::world;

/// A dozen roundings per light; the spot's edge multiplies the error of a cosine by 1 / (cos inner - cos outer) <= 10.
const TOLERANCE: Tolerance = Tolerance { absolute: 2e-5, relative: 2e-5 };

fn vector(random: &mut Random) -> Vec3 {
    Vec3::new(random.unit(), random.unit(), random.unit()) * 2.0 - 1.0
}

pub fn lights(random: &mut Random) -> Vec<PosedLight> {
    let spot = LightKind::Spot { inner_angle: 0.4, outer_angle: 0.9 };
    let kinds = [
        (LightKind::Point, None),
        (LightKind::Point, Some(3.5)),
        (LightKind::Point, Some(0.1)),
        (spot, None),
        (spot, Some(4.0)),
        (LightKind::Directional, None),
        (LightKind::Directional, Some(1.0)),
    ];
    let light = |(kind, range)| PosedLight {
        node: 0,
        light: 0,
        position: Vec3::new(0.0, 2.0, 0.0) + 0.5 * vector(random),
        direction: (Vec3::NEG_Y + 0.5 * vector(random)).normalize(),
        kind,
        intensity: Vec3::new(1.0, 2.0, 3.0) * (0.5 + random.unit()),
        range,
    };
    kinds.map(light).to_vec()
}

/// Irradiance on a plane that faces the light, and the direction towards it.               [KHR_lights_punctual]
pub fn arriving(light: &PosedLight, point: Vec3) -> (Vec3, Vec3) {
    if light.kind == LightKind::Directional {
        return (light.intensity, -light.direction);
    }
    let offset = light.position - point;
    let (distance, to_light) = (offset.length(), offset.normalize());
    let window = light.range.map_or(1.0, |range| (1.0 - (distance / range).powi(4)).clamp(0.0, 1.0));
    let cone = match light.kind {
        LightKind::Spot { inner_angle, outer_angle } => {
            let cosine = light.direction.dot(-to_light);
            let falloff = (cosine - outer_angle.cos()) / (inner_angle.cos() - outer_angle.cos());
            falloff.clamp(0.0, 1.0).powi(2)
        }
        _ => 1.0,
    };
    (light.intensity * window * cone / distance.powi(2), to_light)
}

/// The twin, over the kernel's tables.
fn punctual_irradiance(positions: &[Vec3], normals: &[Vec3], lights: &[PosedLight], visibility: &[f32]) -> Vec<Vec3> {
    let element = |(index, (&position, &normal)): (usize, (&Vec3, &Vec3))| {
        let mut sum = Vec3::ZERO;
        for (light, described) in lights.iter().enumerate() {
            let (irradiance, to_light) = arriving(described, position);
            sum += irradiance * (normal.dot(to_light).max(0.0) * visibility[light * positions.len() + index]);
        }
        sum
    };
    positions.iter().zip(normals).enumerate().map(element).collect()
}

struct Case {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    visibility: Vec<f32>,
}

impl Case {
    fn new(element_count: usize, light_count: usize, random: &mut Random) -> Self {
        Self {
            positions: (0..element_count).map(|_| vector(random)).collect(),
            normals: (0..element_count).map(|_| (Vec3::Y + 1.2 * vector(random)).normalize()).collect(),
            visibility: (0..element_count * light_count).map(|_| random.below(5) as f32 / 4.0).collect(),
        }
    }

    fn on_device(&self, context: &Context, lights: &[PosedLight]) -> Vec<Vec3> {
        let table: Vec<Light> = lights.iter().map(world::light).collect();
        let irradiance = context.buffer("test/irradiance", self.positions.len()).unwrap();
        let pass = PunctualIrradiance {
            element_positions: &context.upload("test/positions", &self.positions).unwrap(),
            element_normals: &context.upload("test/normals", &self.normals).unwrap(),
            lights: &context.upload("test/lights", &table).unwrap(),
            visibility: &context.upload("test/visibility", &self.visibility).unwrap(),
            irradiance: &irradiance,
            params: PunctualIrradianceParams {
                element_count: self.positions.len() as u32,
                light_count: lights.len() as u32,
            },
        };
        let mut recorder = context.recorder("test").unwrap();
        recorder.dispatch(&pass, self.positions.len());
        recorder.submit().unwrap();
        context.download(&irradiance).unwrap()
    }

    fn twin(&self, lights: &[PosedLight]) -> Vec<Vec3> {
        punctual_irradiance(&self.positions, &self.normals, lights, &self.visibility)
    }
}

#[test]
fn punctual_irradiance_agrees_with_its_twin() {
    let context = TestContext::new();
    let random = &mut Random(11);
    let lights = lights(random);
    for element_count in [0, 1, 63, 64, 65, 1009] {
        for lit in [&lights[..], &lights[..1], &[]] {
            let case = Case::new(element_count, lit.len(), random);
            let what = format!("{element_count} elements, {} lights", lit.len());
            hold(&what, &case.on_device(&context, lit), &case.twin(lit), TOLERANCE);
        }
    }
    // Each light matters, and so does each part of its falloff.
    let case = Case::new(1009, lights.len(), random);
    let expected = case.twin(&lights);
    for (index, light) in lights.iter().enumerate() {
        let change = |light: PosedLight| {
            let mut changed = lights.clone();
            changed[index] = light;
            tells_apart(&format!("a change of light {index}"), &case.twin(&changed), &expected, TOLERANCE);
        };
        if light.range != Some(0.1) {
            change(PosedLight { intensity: Vec3::ZERO, ..light.clone() });
        }
        if light.range.is_some() && light.kind != LightKind::Directional {
            change(PosedLight { range: None, ..light.clone() });
        }
        if matches!(light.kind, LightKind::Spot { .. }) {
            change(PosedLight { kind: LightKind::Point, ..light.clone() });
        }
    }
}

/// More elements than one dimension of a dispatch takes: the list is folded.
#[test]
fn more_elements_than_one_dispatch_dimension_are_all_lit() {
    let context = TestContext::new();
    let element_count = 64 * context.limits().workgroup_count as usize + 65;
    if element_count as u64 * 12 > context.limits().storage_buffer_bytes {
        println!("skipped: this device folds no list of vectors that it can bind");
        return;
    }
    let sun =
        [PosedLight { kind: LightKind::Directional, direction: Vec3::NEG_Y, ..lights(&mut Random(1))[0].clone() }];
    let case = Case {
        positions: vec![Vec3::ZERO; element_count],
        normals: vec![Vec3::Y; element_count],
        // Exact in f32, and different from element to element.
        visibility: (0..element_count as u32).map(|i| (i % 1021) as f32 / 1024.0).collect(),
    };
    let got = case.on_device(&context, &sun);
    let wrong = got.iter().zip(&case.visibility).position(|(&e, &v)| e != sun[0].intensity * v);
    assert_eq!((got.len(), wrong), (element_count, None));
}
