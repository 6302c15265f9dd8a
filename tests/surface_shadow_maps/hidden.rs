//! Parts of texels inside of other things: left out, and nothing else is.

use crate::common::TestContext;
use crate::common::scenes::{lambert, parallelogram, scene};
use crate::fixture::Fixture;
use glam::Vec3;
use linklight::gpu::shaders::atlas::{PartHits, PartHitsParams, PartRays, PartRaysParams};
use linklight::gpu::shaders::types::{Hit, Ray};
use linklight::scene::environment::Environment;
use linklight::scene::{Material, Scene};
use linklight::stages::hidden_parts::{self, Seen};
use linklight::stages::trace::{BACK_FACE, NO_HIT};
use linklight::stages::work::Unwatched;

/// A floor of 4 x 4 m with a closed box of 1 x 1 m sunk a little into it.
fn box_on_a_floor(double_sided: bool) -> Scene {
    let (low, size) = (Vec3::new(-0.53, -0.05, -0.47), Vec3::ONE);
    let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| axis * size.dot(axis));
    let mut faces = vec![parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, 1, 0)];
    for (corner, u, v) in [(low, y, x), (low, z, y), (low, x, z), (low + x, y, z), (low + y, z, x), (low + z, x, y)] {
        faces.push(parallelogram(corner, u, v, 1, 0));
    }
    let material = Material { double_sided, ..lambert(Vec3::splat(0.5)) };
    scene(vec![material], faces, &[])
}

fn area_of_floor(fixture: &Fixture, context: &TestContext) -> (f32, f32) {
    let mut atlas = fixture.atlas(32);
    let area = |atlas: &linklight::scene::atlas::Atlas| -> f32 {
        let floor = atlas.texels.iter().filter(|texel| texel.position.y == 0.0 && texel.normal.y > 0.5);
        floor.map(|texel| texel.area).sum()
    };
    let before = area(&atlas);
    let seen = Seen { tracers: &[fixture.tracer()], triangle_objects: &[], ray_offset: 1e-4 };
    let (geometry, positions) = (&fixture.geometry, &fixture.positions);
    let hidden = hidden_parts::leave_out(context, &seen, geometry, positions, &mut atlas, &Unwatched).unwrap();
    println!("{hidden} parts are hidden; the floor has {} m2 of {before}", area(&atlas));
    for (index, texel) in atlas.texels.iter().enumerate() {
        let parts: f32 = atlas.parts_of(index).iter().map(|part| part.area).sum();
        assert!((parts / texel.area - 1.0).abs() < 1e-4);
        assert_eq!(atlas.texel_at[(texel.at.y * atlas.resolution + texel.at.x) as usize], index as u32);
    }
    if hidden > 0 {
        let inside = |p: Vec3| p.y < 0.5 && (p.x + 0.03).abs() < 0.499 && (p.z - 0.03).abs() < 0.499 && p.y > -0.04;
        let stray = atlas.texels.iter().find(|texel| inside(texel.position));
        assert!(stray.is_none(), "a texel stands inside the box: {stray:?}");
    }
    (before, area(&atlas))
}

#[test]
fn what_lies_inside_a_box_is_left_out_to_a_quarter_of_a_texel() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, box_on_a_floor(false), &Environment::default());
    let (before, after) = area_of_floor(&fixture, &context);
    assert!((before - 16.0).abs() < 1e-3);
    // A cell of the border belongs to either side: a quarter of a texel of 0.3 m along 4 m.
    assert!((after - 15.0).abs() < 0.2, "{after}");
    // The backs of two-sided surfaces tell nothing.
    let fixture = Fixture::new(&context, box_on_a_floor(true), &Environment::default());
    let (before, after) = area_of_floor(&fixture, &context);
    assert_eq!(before, after);
}

#[test]
fn part_rays_leave_the_front_and_their_hits_are_counted() {
    let context = TestContext::new();
    let normals = [Vec3::X, Vec3::NEG_Y, Vec3::new(0.48, 0.6, -0.64)];
    let points = [Vec3::ZERO, Vec3::splat(2.0), Vec3::new(-1.0, 5.0, 0.5)];
    let [points_buffer, normals_buffer] = [&points, &normals].map(|v| context.upload("test/vectors", v).unwrap());
    let (sample_count, ray_offset) = (256, 0.25);
    let rays = context.buffer::<Ray>("test/rays", 2 * 256).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    // The second and third parts alone.
    let params = PartRaysParams { first_part: 1, batch_count: 2, sample_count, ray_offset };
    recorder.dispatch(&PartRays { points: &points_buffer, normals: &normals_buffer, rays: &rays, params }, 512u32);
    recorder.submit().unwrap();
    let rays = context.download(&rays).unwrap();
    for (part, rays) in rays.chunks(256).enumerate() {
        let (point, normal) = (points[part + 1], normals[part + 1]);
        let cosines = rays.iter().map(|ray| {
            assert!(ray.origin.distance(point + ray_offset * normal) < 1e-5 && ray.t_min == 0.0 && ray.t_max > 1e38);
            assert!((ray.direction.length() - 1.0).abs() < 1e-4);
            ray.direction.dot(normal)
        });
        let cosines: Vec<f32> = cosines.collect();
        assert!(cosines.iter().all(|&cosine| cosine > 0.0));
        // Cosine-weighted: 2/3 in the mean.
        assert!((cosines.iter().sum::<f32>() / 256.0 - 2.0 / 3.0).abs() < 0.01);
    }

    // Triangle 0 is one-sided, triangle 1 two-sided.
    let fixture = Fixture::new(&context, box_on_a_floor(false), &Environment::default());
    let two = Fixture::new(&context, box_on_a_floor(true), &Environment::default());
    let mut materials = context.download(&fixture.world.materials).unwrap();
    materials.extend(context.download(&two.world.materials).unwrap());
    let second = materials.len() as u32 / 2;
    let materials = context.upload("test/materials", &materials).unwrap();
    let triangle_materials = context.upload("test/triangle materials", &[0u32, second]).unwrap();
    let hit = |triangle| Hit { t: 1.0, triangle, barycentrics: glam::Vec2::ZERO };
    let hits = [[BACK_FACE, 0, NO_HIT, BACK_FACE], [1 | BACK_FACE, 1, 1 | BACK_FACE, BACK_FACE]];
    let hits: Vec<Hit> = hits.as_flattened().iter().map(|&triangle| hit(triangle)).collect();
    let hits = context.upload("test/hits", &hits).unwrap();
    let back_hits = context.upload("test/back hits", &[9u32; 3]).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    let params = PartHitsParams { first_part: 1, batch_count: 2, sample_count: 4 };
    recorder.dispatch(
        &PartHits {
            hits: &hits,
            triangle_materials: &triangle_materials,
            materials: &materials,
            back_hits: &back_hits,
            params,
        },
        2u32,
    );
    recorder.submit().unwrap();
    assert_eq!(context.download(&back_hits).unwrap(), [9, 2, 1]);
}
