//! The splatting display against what it must reproduce.

use crate::common::TestContext;
use crate::common::scenes::{lambert, parallelogram, scene};
use crate::fixture::Fixture;
use crate::support::{prepare, settings};
use glam::{UVec2, Vec2, Vec3};
use linklight::display::direct::{Canvas, Lighting};
use linklight::display::g_buffer::GBuffer;
use linklight::display::shadow_maps::ShadowMaps;
use linklight::display::splat::{self, SplatLight, SplatSums};
use linklight::display::vertex::VertexLight;
use linklight::scene::camera::View;
use linklight::scene::pose::Pose;
use linklight::stages::film::Film;

const SIZE: u32 = 64;

/// Light that is linear over a regular grid of patches comes out linear between them within 1 % of its range, and even
/// light even up to the edge.
#[test]
fn splats_reproduce_even_and_linear_light() {
    let context = TestContext::new();
    let floor = parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, 8, 0);
    let fixture = Fixture::new(&context, scene(vec![lambert(Vec3::splat(0.5))], vec![floor], &[]), None);
    let method = prepare(&context, &fixture, settings(72));
    let view = View::towards(Vec3::new(0.01, 4.0, 0.0), Vec3::ZERO, 1.0, UVec2::splat(SIZE));
    let pose = Pose::rest(&fixture.scene);
    let splats = context.download(&method.splats().splats).unwrap();
    let shares = context.download(&method.splats().shares).unwrap();
    assert!(splats.iter().all(|splat| splat.share_count == 1));
    let sums = SplatSums::new(&context, SIZE, SIZE).unwrap();
    let (g_buffer, shadow_maps) =
        (GBuffer::new(&context, SIZE, SIZE).unwrap(), ShadowMaps::new(&context, &pose, [SIZE, SIZE]).unwrap());
    let film = Film::new(&context, SIZE, SIZE).unwrap();
    let shown = |light: &dyn Fn(Vec3) -> f32| {
        let mut irradiance = vec![Vec3::ZERO; method.elements().count as usize];
        splats.iter().for_each(|splat| {
            irradiance[shares[splat.first_share as usize].vertex as usize] = Vec3::splat(light(splat.center))
        });
        let irradiance = context.upload("test/irradiance", &irradiance).unwrap();
        let mut recorder = context.recorder("test").unwrap();
        let vertices = VertexLight {
            direct_irradiance: &irradiance,
            indirect_irradiance: &irradiance,
            back_elements: &method.elements().back_elements,
            colors: None,
        };
        let light = SplatLight { vertices, splats: method.splats(), sums: &sums };
        let (world, shadow_maps, g_buffer) = (&fixture.world, &shadow_maps, &g_buffer);
        let tracer = fixture.stage().tracer;
        let lighting = Lighting { world, shadow_maps, tracer, g_buffer };
        let canvas = Canvas { lighting, view: &view, samples: 1, film: &film };
        splat::draw(&mut recorder, light, canvas);
        recorder.submit().unwrap();
        context.download(&film.indirect).unwrap()
    };
    let point = |pixel: u32| {
        let ray = view.ray(Vec2::new((pixel % SIZE) as f32 + 0.5, (pixel / SIZE) as f32 + 0.5), UVec2::splat(SIZE));
        ray.origin - ray.origin.y / ray.direction.y * ray.direction
    };
    let linear = |at: Vec3| 3.0 + at.x - 0.5 * at.z;
    let (even, sloped) = (shown(&|_| 2.0), shown(&linear));
    let mut inner = 0;
    for pixel in 0..SIZE * SIZE {
        let (at, index) = (point(pixel), pixel as usize);
        let from_edge = 2.0 - at.x.abs().max(at.z.abs());
        if from_edge > 0.01 {
            assert!((even[index].x * std::f32::consts::PI / 0.5 - 2.0).abs() < 1e-4, "{at}: {}", even[index].x);
        }
        // Patches at the edge are half as wide as the others.
        if from_edge > 1.0 {
            inner += 1;
            let found = sloped[index].x * std::f32::consts::PI / 0.5;
            assert!((found - linear(at)).abs() < 2e-3, "{at}: {found} for {}", linear(at));
        }
    }
    assert!(inner > 100, "{inner}");
}
