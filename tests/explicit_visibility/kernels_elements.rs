//! Passes over elements against their twins.

use crate::common::{Random, TestContext};
use crate::meshes::{COUNTS, Mesh, assert_close, points, rows, unit};
use crate::twins;
use glam::{UVec2, Vec2, Vec3};
use linklight::gpu::shaders::elements as passes;
use linklight::gpu::shaders::methods::explicit_visibility as method_passes;
use linklight::gpu::shaders::types::{OpenPlace, Ray};
use linklight::stages::open_places::AT_ITS_VERTEX;
use std::f32::consts::PI;

#[test]
fn place_agrees_with_its_twin() {
    let context = TestContext::new();
    let mut random = Random(11);
    for count in COUNTS {
        let mesh = Mesh::random(&mut random, count);
        // Every third element looks from elsewhere.
        let triangle_count = mesh.triangles.len() as u32;
        let places = (0..count).map(|element| match element % 3 {
            0 if triangle_count > 0 => {
                let barycentrics = Vec2::new(random.unit(), random.unit()) * 0.5;
                OpenPlace { triangle: random.below(triangle_count), barycentrics }
            }
            _ => AT_ITS_VERTEX,
        });
        let places: Vec<OpenPlace> = places.collect();
        let out = [(); 3].map(|()| context.buffer::<Vec3>("test/out", count as usize).unwrap());
        let mut recorder = context.recorder("test").unwrap();
        let pass = passes::Place {
            element_vertices: &context.upload("test/vertices", &mesh.element_vertices).unwrap(),
            positions: &context.upload("test/positions", &mesh.positions).unwrap(),
            normals: &context.upload("test/normals", &mesh.normals).unwrap(),
            triangles: &mesh.device_triangles(&context),
            incident_offsets: &context.upload("test/offsets", &mesh.incident.offsets).unwrap(),
            incident_triangles: &context.upload("test/incident", &mesh.incident.values).unwrap(),
            element_positions: &out[0],
            element_normals: &out[1],
            ray_origins: &out[2],
            open_places: &context.upload("test/open places", &places).unwrap(),
            params: passes::PlaceParams { element_count: count, ray_offset: 0.01 },
        };
        recorder.dispatch(&pass, count);
        recorder.submit().unwrap();
        let twin = twins::elements::place(
            &mesh.element_vertices,
            &mesh.positions,
            &mesh.normals,
            &mesh.triangles,
            &mesh.incident,
            &places,
            0.01,
        );
        for (buffer, twin) in out.iter().zip(&twin) {
            assert_close("place", &context.download(buffer).unwrap(), twin, 1e-6, 1e-6);
        }
    }
}

#[test]
fn rays_agree_with_their_twin_and_are_cosine_weighted() {
    let context = TestContext::new();
    let mut random = Random(12);
    for (count, first, side, is_rotated) in [(1, 0, 4, false), (63, 2, 8, true), (65, 0, 12, false), (5, 7, 32, true)] {
        let origins = points(&mut random, first + count);
        let normals: Vec<Vec3> = (0..first + count).map(|_| unit(&mut random)).collect();
        let rays = context.buffer::<Ray>("test/rays", (count * side * side) as usize).unwrap();
        let mut recorder = context.recorder("test").unwrap();
        let pass = method_passes::Rays {
            ray_origins: &context.upload("test/origins", &origins).unwrap(),
            element_normals: &context.upload("test/normals", &normals).unwrap(),
            rays: &rays,
            params: method_passes::RaysParams {
                first_element: first,
                batch_count: count,
                side,
                is_rotated: u32::from(is_rotated),
            },
        };
        recorder.dispatch(&pass, rays.len());
        recorder.submit().unwrap();
        let device = context.download(&rays).unwrap();
        let twin = twins::elements::rays(&origins, &normals, first, count, side, is_rotated);
        // The tolerance is that of the driver's sine and cosine (Vulkan asks for 2^-11 only; lavapipe gives 2^-20).
        let directions = |rays: &[Ray]| rays.iter().map(|r| r.direction).collect::<Vec<_>>();
        assert_close("directions", &directions(&device), &directions(&twin), 1e-5, 0.0);
        assert!(device.iter().zip(&twin).all(|(a, b)| (a.origin, a.t_min, a.t_max) == (b.origin, b.t_min, b.t_max)));

        // Mean of the cosine over cosine-weighted directions: 2/3.
        let per_element = (side * side) as usize;
        for (element, own) in device.chunks(per_element).enumerate() {
            let normal = normals[first as usize + element];
            let mean = own.iter().map(|r| r.direction.dot(normal)).sum::<f32>() / per_element as f32;
            let allowed = 0.7 / side as f32;
            assert!((mean - 2.0 / 3.0).abs() < allowed, "mean cosine {mean} of {per_element} rays");
        }
    }
}

#[test]
fn pointwise_passes_agree_with_their_twins() {
    let context = TestContext::new();
    let mut random = Random(13);
    for count in COUNTS {
        let n = count as usize;
        let [a, b] = [(); 2].map(|()| points(&mut random, count));
        let flags: Vec<u32> = (0..count).map(|_| random.below(2)).collect();
        let [term, sum] = [&a, &b].map(|values| context.upload("test/values", values).unwrap());
        let flag_buffer = context.upload("test/flags", &flags).unwrap();
        let out = [(); 2].map(|()| context.buffer::<Vec3>("test/out", n).unwrap());
        let mut recorder = context.recorder("test").unwrap();
        let params = passes::ReflectParams { element_count: count };
        recorder.dispatch(&passes::Reflect { irradiance: &term, albedo: &sum, radiosity: &out[0], params }, count);
        let params = passes::EmittedRadiosityParams { element_count: count };
        let pass = passes::EmittedRadiosity { emission: &term, is_sampled: &flag_buffer, radiosity: &out[1], params };
        recorder.dispatch(&pass, count);
        let params = passes::AddParams { element_count: count };
        recorder.dispatch(&passes::Add { term: &term, sum: &sum, params }, count);
        recorder.submit().unwrap();

        let product: Vec<Vec3> = a.iter().zip(&b).map(|(a, b)| *a * *b).collect();
        assert_close("reflect", &context.download(&out[0]).unwrap(), &product, 0.0, 1e-6);
        let emitted: Vec<Vec3> =
            a.iter().zip(&flags).map(|(a, flag)| if *flag == 0 { PI * *a } else { Vec3::ZERO }).collect();
        assert_close("emitted_radiosity", &context.download(&out[1]).unwrap(), &emitted, 0.0, 1e-6);
        let total: Vec<Vec3> = a.iter().zip(&b).map(|(a, b)| *a + *b).collect();
        assert_close("add", &context.download(&sum).unwrap(), &total, 1e-6, 1e-6);
    }
}

#[test]
fn passes_over_neighbours_agree_with_their_twins() {
    let context = TestContext::new();
    let mut random = Random(14);
    for count in COUNTS {
        let ring = rows(&mut random, count);
        let normals: Vec<Vec3> = (0..count).map(|_| unit(&mut random)).collect();
        let irradiance = points(&mut random, count);
        let outcomes: Vec<u32> = (0..count).map(|_| random.below(257) | random.below(99) << 16).collect();
        let ring_offsets = context.upload("test/offsets", &ring.offsets).unwrap();
        let ring_values = context.upload("test/ring", &ring.values).unwrap();
        let device = context.upload("test/irradiance", &irradiance).unwrap();
        let smoothed = context.buffer::<Vec3>("test/smoothed", count as usize).unwrap();
        let element_normals = context.upload("test/normals", &normals).unwrap();
        let mut recorder = context.recorder("test").unwrap();
        let pass = passes::Smooth {
            ring_offsets: &ring_offsets,
            ring: &ring_values,
            element_normals: &element_normals,
            irradiance: &device,
            smoothed: &smoothed,
            params: passes::SmoothParams { element_count: count, cos_feature_angle: 0.3 },
        };
        recorder.dispatch(&pass, count);
        let pass = passes::FillUnresolved {
            outcomes: &context.upload("test/outcomes", &outcomes).unwrap(),
            ring_offsets: &ring_offsets,
            ring: &ring_values,
            element_normals: &element_normals,
            irradiance: &device,
            params: passes::FillUnresolvedParams { element_count: count, ray_count: 256 },
        };
        recorder.dispatch(&pass, count);
        recorder.submit().unwrap();
        let twin = twins::elements::smooth(&ring, &normals, &irradiance, 0.3);
        assert_close("smooth", &context.download(&smoothed).unwrap(), &twin, 1e-6, 1e-5);
        let mut filled = irradiance.clone();
        twins::elements::fill_unresolved(&outcomes, &ring, &normals, &mut filled, 256);
        assert_close("fill_unresolved", &context.download(&device).unwrap(), &filled, 1e-6, 1e-5);
        assert!(count < 60 || filled != irradiance, "some elements are unresolved");

        // Of two elements in the open each, those before them.
        let pairs: Vec<UVec2> = (0..count / 3).map(|k| UVec2::new(3 * k, 3 * k + 1 + random.below(2))).collect();
        let values = context.upload("test/values", &irradiance).unwrap();
        let mut recorder = context.recorder("test").unwrap();
        let pairs_buffer = context.upload("test/pairs", &pairs).unwrap();
        let params = passes::TakeOverParams { pair_count: pairs.len() as u32 };
        recorder.dispatch(&passes::TakeOver { pairs: &pairs_buffer, values: &values, params }, pairs.len() as u32);
        recorder.submit().unwrap();
        let mut taken = irradiance.clone();
        twins::elements::take_over(&pairs, &mut taken);
        assert_eq!(context.download(&values).unwrap(), taken, "take_over");
    }
}
