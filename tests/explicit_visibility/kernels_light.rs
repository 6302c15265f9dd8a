//! Light source passes against their twins.

use crate::common::{Random, TestContext};
use crate::meshes::{COUNTS, Mesh, assert_close, points, unit};
use crate::twins::{self, light::ShadowMesh};
use glam::{Vec2, Vec3};
use linklight::gpu::shaders::elements as passes;
use linklight::gpu::shaders::types::{EmitterSample, Light, Ray};
use linklight::stages::open_places::AT_ITS_VERTEX;

/// One of each kind.
fn lights(random: &mut Random) -> Vec<Light> {
    let light = |kind: u32, random: &mut Random| Light {
        position: 3.0 * unit(random),
        kind,
        direction: unit(random),
        range: if kind == 0 { 7.0 } else { 0.0 },
        intensity: unit(random).abs() * 5.0,
        spot_scale: if kind == 1 { 2.0 } else { 0.0 },
        spot_offset: if kind == 1 { 0.25 } else { 1.0 },
    };
    (0..3).map(|kind| light(kind, random)).collect()
}

fn assert_same_rays(what: &str, device: &[Ray], twin: &[Ray]) {
    let vectors = |rays: &[Ray], f: fn(&Ray) -> Vec3| rays.iter().map(f).collect::<Vec<_>>();
    assert_close(what, &vectors(device, |r| r.origin), &vectors(twin, |r| r.origin), 1e-5, 1e-5);
    assert_close(what, &vectors(device, |r| r.direction), &vectors(twin, |r| r.direction), 1e-5, 1e-5);
    for (i, (a, b)) in device.iter().zip(twin).enumerate() {
        assert_eq!(a.t_min, b.t_min, "{what}[{i}]");
        assert!((a.t_max - b.t_max).abs() <= 1e-5 * b.t_max.abs(), "{what}[{i}]: t_max {} and {}", a.t_max, b.t_max);
    }
}

#[test]
fn punctual_passes_agree_with_their_twins() {
    let context = TestContext::new();
    let mut random = Random(31);
    for count in COUNTS {
        let mesh = Mesh::random(&mut random, count);
        let lights = lights(&mut random);
        let [_, normals, origins] = twins::elements::place(
            &mesh.element_vertices,
            &mesh.positions,
            &mesh.normals,
            &mesh.triangles,
            &mesh.incident,
            &vec![AT_ITS_VERTEX; mesh.element_vertices.len()],
            0.01,
        );
        let element_vertices = context.upload("test/vertices", &mesh.element_vertices).unwrap();
        let element_normals = context.upload("test/normals", &normals).unwrap();
        let shadow_offsets = context.upload("test/offsets", &mesh.shadow_offsets).unwrap();
        let light_table = context.upload("test/lights", &lights).unwrap();
        let ray_count = *mesh.shadow_offsets.last().unwrap();
        let visibility = context.buffer::<f32>("test/visibility", 3 * count as usize).unwrap();
        let mut all_visibility = Vec::new();
        for (k, light) in lights.iter().enumerate() {
            let rays = context.buffer::<Ray>("test/rays", ray_count as usize).unwrap();
            let pass = passes::PunctualRays {
                element_vertices: &element_vertices,
                element_normals: &element_normals,
                ray_origins: &context.upload("test/origins", &origins).unwrap(),
                shadow_offsets: &shadow_offsets,
                positions: &context.upload("test/positions", &mesh.positions).unwrap(),
                triangles: &mesh.device_triangles(&context),
                incident_offsets: &context.upload("test/incident offsets", &mesh.incident.offsets).unwrap(),
                incident_triangles: &context.upload("test/incident", &mesh.incident.values).unwrap(),
                lights: &light_table,
                rays: &rays,
                params: passes::PunctualRaysParams {
                    first_element: 0,
                    batch_count: count,
                    light: k as u32,
                    ray_offset: 0.01,
                },
            };
            let is_free: Vec<u32> = (0..ray_count).map(|_| random.below(2)).collect();
            let visibility_pass = passes::PunctualVisibility {
                shadow_offsets: &shadow_offsets,
                rays: &rays,
                is_free: &context.upload("test/free", &is_free).unwrap(),
                visibility: &visibility,
                params: passes::PunctualVisibilityParams {
                    first_element: 0,
                    batch_count: count,
                    element_count: count,
                    light: k as u32,
                },
            };
            let mut recorder = context.recorder("test").unwrap();
            recorder.dispatch(&pass, count);
            recorder.dispatch(&visibility_pass, count);
            recorder.submit().unwrap();
            let shadow_mesh = ShadowMesh {
                element_vertices: &mesh.element_vertices,
                element_normals: &normals,
                ray_origins: &origins,
                shadow_offsets: &mesh.shadow_offsets,
                positions: &mesh.positions,
                triangles: &mesh.triangles,
                incident: &mesh.incident,
            };
            let twin = twins::light::punctual_rays(&shadow_mesh, light, 0, count, 0.01);
            assert_same_rays("punctual_rays", &context.download(&rays).unwrap(), &twin);
            all_visibility.extend(twins::light::punctual_visibility(&mesh.shadow_offsets, &twin, &is_free));
        }
        assert_eq!(context.download(&visibility).unwrap(), all_visibility);
    }
}

#[test]
fn emitter_passes_agree_with_their_twins() {
    let context = TestContext::new();
    let mut random = Random(32);
    for (count, sample_count) in COUNTS.into_iter().zip([5, 1, 31, 32, 33, 70]) {
        let mesh = Mesh::random(&mut random, count);
        let samples: Vec<EmitterSample> = (0..sample_count)
            .map(|_| EmitterSample {
                triangle: random.below(mesh.triangles.len() as u32),
                barycentrics: Vec2::new(random.unit(), random.unit()) * 0.5,
                share: random.unit(),
                is_double_sided: random.below(2),
            })
            .collect();
        let [positions, normals, origins] = twins::elements::place(
            &mesh.element_vertices,
            &mesh.positions,
            &mesh.normals,
            &mesh.triangles,
            &mesh.incident,
            &vec![AT_ITS_VERTEX; mesh.element_vertices.len()],
            0.01,
        );
        let emission: Vec<Vec3> = points(&mut random, mesh.positions.len() as u32).iter().map(|p| p.abs()).collect();
        let is_free: Vec<u32> = (0..count * sample_count).map(|_| random.below(2)).collect();
        let words = sample_count.div_ceil(32);
        let element_normals = context.upload("test/normals", &normals).unwrap();
        let sample_table = context.upload("test/samples", &samples).unwrap();
        let triangles = mesh.device_triangles(&context);
        let vertex_positions = context.upload("test/positions", &mesh.positions).unwrap();
        let rays = context.buffer::<Ray>("test/rays", is_free.len()).unwrap();
        let visible = context.buffer::<u32>("test/visible", (count * words) as usize).unwrap();
        let irradiance = context.buffer::<Vec3>("test/irradiance", count as usize).unwrap();
        let mut recorder = context.recorder("test").unwrap();
        let pass = passes::EmitterRays {
            element_normals: &element_normals,
            ray_origins: &context.upload("test/origins", &origins).unwrap(),
            samples: &sample_table,
            triangles: &triangles,
            positions: &vertex_positions,
            rays: &rays,
            params: passes::EmitterRaysParams { first_element: 0, batch_count: count, sample_count, ray_offset: 0.01 },
        };
        recorder.dispatch(&pass, rays.len());
        let pass = passes::PackVisibility {
            rays: &rays,
            is_free: &context.upload("test/free", &is_free).unwrap(),
            visible: &visible,
            params: passes::PackVisibilityParams { first_word: 0, row_count: count, row_length: sample_count },
        };
        recorder.dispatch(&pass, visible.len());
        let pass = passes::EmitterIrradiance {
            element_positions: &context.upload("test/element positions", &positions).unwrap(),
            element_normals: &element_normals,
            samples: &sample_table,
            triangles: &triangles,
            positions: &vertex_positions,
            emission: &context.upload("test/emission", &emission).unwrap(),
            visible: &visible,
            irradiance: &irradiance,
            params: passes::EmitterIrradianceParams { element_count: count, sample_count },
        };
        recorder.dispatch(&pass, count);
        recorder.submit().unwrap();

        let (at, t) = (&mesh.positions, &mesh.triangles);
        let twin = twins::light::emitter_rays(&normals, &origins, &samples, t, at, 0, count, 0.01);
        assert_same_rays("emitter_rays", &context.download(&rays).unwrap(), &twin);
        let bits = twins::light::pack_visibility(&twin, &is_free, sample_count as usize);
        assert_eq!(context.download(&visible).unwrap(), bits);
        let twin = twins::light::emitter_irradiance(&positions, &normals, &samples, t, at, &emission, &bits);
        assert_close("emitter_irradiance", &context.download(&irradiance).unwrap(), &twin, 1e-5, 1e-4);
    }
}
