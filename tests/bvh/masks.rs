//! Holes of alpha masks: rays pass them in both tracers, and nothing else changes.

use crate::common::scenes::{lambert, nearest_texture, parallelogram, scene};
use crate::common::{Random, TestContext};
use crate::trace::cast_by;
use glam::{Vec2, Vec3, Vec4};
use linklight::gpu::shaders::types::Ray;
use linklight::scene::environment::Environment;
use linklight::scene::geometry::Geometry;
use linklight::scene::pose::Pose;
use linklight::scene::{Image, Material, TextureRef};
use linklight::stages::bvh::Bvh;
use linklight::stages::trace::Tracer;
use linklight::stages::world::World;

const CELLS: u32 = 8;

/// A checkerboard of CELLS x CELLS texels; the odd ones are holes.
fn is_hole(uv: Vec2) -> bool {
    let cell = (uv * CELLS as f32).as_uvec2();
    (cell.x + cell.y) % 2 == 1
}

#[test]
fn rays_pass_holes_of_masks() {
    let context = TestContext::new();
    let texel = |k: u32| [255, 255, 255, if (k % CELLS + k / CELLS) % 2 == 1 { 0 } else { 255 }];
    let image = Image {
        name: "checkerboard".into(),
        width: CELLS,
        height: CELLS,
        rgba: (0..CELLS * CELLS).flat_map(texel).collect(),
        srgb: true,
    };
    let nearest = nearest_texture(0);
    let slot = TextureRef { texture: 0, uv_set: 0, transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] };
    let masked = Material {
        base_color: Vec4::ONE,
        base_color_texture: Some(slot),
        alpha_cutoff: Some(0.5),
        ..lambert(Vec3::splat(0.5))
    };
    // The screen at z = 0 before an opaque wall at z = -1.
    let screen = parallelogram(Vec3::ZERO, Vec3::X, Vec3::Y, 3, 0);
    let wall = parallelogram(Vec3::new(-9.0, -9.0, -1.0), 18.0 * Vec3::X, 18.0 * Vec3::Y, 1, 1);
    let mut scene = scene(vec![masked, lambert(Vec3::splat(0.5))], vec![screen, wall], &[]);
    scene.images.push(image);
    scene.textures.push(nearest);
    let geometry = Geometry::flatten(&scene, u64::MAX).unwrap();
    let pose = Pose::rest(&scene);
    let world = World::new(&context, &scene, &geometry, &pose, &Environment::Constant(Vec3::ZERO), false).unwrap();
    assert!(world.has_holes);
    let positions = context.download(&world.positions).unwrap();
    let bvh = Bvh::build(&context, &positions, &geometry.triangles).unwrap();

    let mut random = Random(17);
    let rays: Vec<Ray> = (0..4099)
        .map(|_| {
            let target = Vec3::new(random.unit(), random.unit(), 0.0);
            let origin = Vec3::new(3.0 * random.unit() - 1.0, 3.0 * random.unit() - 1.0, 1.0 + random.unit());
            // The wall lies beyond every ray of the other half.
            let t_max = if random.below(2) == 0 { f32::INFINITY } else { 1.2 };
            Ray { origin, t_min: 0.0, direction: target - origin, t_max }
        })
        .collect();
    let structure = context.acceleration_structure("test/structure", &world.positions, &world.triangles).unwrap();
    if let Some(structure) = &structure {
        let mut recorder = context.recorder("test").unwrap();
        recorder.build_acceleration_structure(structure, &world.positions, &world.triangles);
        recorder.submit().unwrap();
    }
    let by_query = structure.as_ref().map(|structure| Tracer::ray_query(structure, &world));
    for tracer in [Tracer::compute(&bvh, &world)].into_iter().chain(by_query) {
        let (hits, visibility) = cast_by(&context, &tracer, &rays);
        let mut passed = 0;
        for ((ray, hit), visibility) in rays.iter().zip(&hits).zip(visibility) {
            let target = (ray.origin + ray.direction).truncate();
            let edge = (target * CELLS as f32).fract();
            if edge.min_element() < 1e-3 || edge.max_element() > 0.999 {
                continue;
            }
            let hole = is_hole(target);
            passed += u32::from(hole);
            let expected_t = if !hole { 1.0 } else { (1.0 + ray.origin.z) / ray.origin.z };
            let blocked = expected_t <= ray.t_max;
            assert_eq!(visibility == 0, blocked, "{ray:?} {hit:?} at {target}, hole {hole}");
            let t = if blocked { expected_t } else { ray.t_max };
            assert!(hit.t == t || (hit.t - t).abs() < 1e-4, "{ray:?} {hit:?} should be at {t}, hole {hole}");
        }
        assert!(passed > 1000, "only {passed} rays pass holes");
    }
}
