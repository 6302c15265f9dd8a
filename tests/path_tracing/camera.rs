//! Primary rays: those of the scene's view, through every pixel, spread evenly inside it.

use crate::common::TestContext;
use glam::{UVec2, Vec2, Vec3, vec2};
use linklight::gpu::shaders::methods::path_tracing::{CameraRays, CameraRaysParams};
use linklight::gpu::shaders::types::{Batch, Ray, ViewInfo};
use linklight::scene::camera::{Lens, View};

const SIZE: UVec2 = UVec2::new(7, 5);

fn views() -> [View; 2] {
    let forward = Vec3::new(0.4, -0.3, -1.0).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let perspective = View {
        position: Vec3::new(1.0, 2.0, 3.0),
        right,
        up: right.cross(forward),
        forward,
        lens: Lens::Perspective { tan_half: vec2(0.7, 0.5) },
        near: 0.25,
        far: Some(40.0),
    };
    let lens = Lens::Orthographic { half_extent: vec2(3.5, 2.5) };
    [perspective, View { lens, near: -1.0, far: None, ..perspective }]
}

/// Rays of `samples` samples of every pixel, sample after sample.
fn camera_rays(context: &TestContext, view: &View, samples: u32, seed: u32) -> Vec<Ray> {
    let pixel_count = SIZE.x * SIZE.y;
    let path_count = pixel_count * samples;
    let rays = context.buffer("test/rays", path_count as usize).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    recorder.dispatch(
        &CameraRays {
            rays: &rays,
            paths: &context.buffer("test/paths", path_count as usize).unwrap(),
            direct: &context.buffer("test/direct", path_count as usize).unwrap(),
            indirect: &context.buffer("test/indirect", path_count as usize).unwrap(),
            params: CameraRaysParams {
                view: ViewInfo::from(view),
                size: SIZE,
                batch: Batch { path_count, pixel_count, first_pixel: 0, first_sample: 0, seed },
            },
        },
        path_count,
    );
    recorder.submit().unwrap();
    context.download(&rays).unwrap()
}

/// Where a ray crosses the picture, in pixels.
fn crossing(view: &View, ray: &Ray) -> Vec2 {
    view.project(ray.origin + 5.0 * ray.direction, SIZE).unwrap().0
}

#[test]
fn rays_are_those_of_the_view() {
    let context = TestContext::new();
    for view in views() {
        for (path, ray) in camera_rays(&context, &view, 3, 1).iter().enumerate() {
            let pixel = path as u32 % (SIZE.x * SIZE.y);
            let at = crossing(&view, ray);
            let inside = at - vec2((pixel % SIZE.x) as f32, (pixel / SIZE.x) as f32);
            assert!(inside.min_element() > -1e-4 && inside.max_element() < 1.0 + 1e-4, "{at} is not in pixel {pixel}");
            let expected = view.ray(at, SIZE);
            assert!((ray.origin - expected.origin).length() < 1e-4, "{ray:?} for {expected:?}");
            assert!((ray.direction - expected.direction).length() < 1e-5, "{ray:?} for {expected:?}");
            assert!((ray.t_min - expected.t_min).abs() < 1e-5, "{ray:?} for {expected:?}");
            let same_end = ray.t_max == expected.t_max || (ray.t_max - expected.t_max).abs() < 1e-3;
            assert!(same_end, "{ray:?} for {expected:?}");
        }
    }
}

/// Samples 0, 2, 4 ... 126 of a pixel put one ray into each of 8 x 8 cells, and so do the odd ones, in another order;
/// other seeds and pixels have other rays.
#[test]
fn samples_fill_a_pixel_evenly() {
    let context = TestContext::new();
    let [_, view] = views();
    let pixels = (SIZE.x * SIZE.y) as usize;
    let rays = camera_rays(&context, &view, 128, 1);
    for pixel in 0..pixels {
        let corner = vec2((pixel as u32 % SIZE.x) as f32, (pixel as u32 / SIZE.x) as f32);
        let places: Vec<Vec2> = (0..128).map(|s| crossing(&view, &rays[s * pixels + pixel]) - corner).collect();
        for half in 0..2 {
            // Off the borders of cells by more than the rounding of the projection: at most one place may stray.
            let mut counts = [0; 64];
            for place in places.iter().skip(half).step_by(2) {
                let cell = (*place * 8.0).as_uvec2().min(UVec2::splat(7));
                counts[(cell.y * 8 + cell.x) as usize] += 1;
            }
            let strays = counts.iter().filter(|&&count| count == 0).count();
            assert!(strays <= 1, "pixel {pixel}, half {half}: {counts:?}");
        }
    }
    let other = camera_rays(&context, &view, 1, 2);
    assert!(other.iter().zip(&rays).all(|(a, b)| a.origin != b.origin));
}

/// What stands before the near plane or behind the far plane is not seen.
#[test]
fn near_and_far_planes_cut() {
    let mut scene = crate::made::scene_of(crate::made::square());
    scene.materials[0].emission = Vec3::ONE;
    let set = crate::render::Set::new(scene, &Default::default(), true);
    let view = crate::render::looking_down(Vec2::splat(0.5), 0.4, 2.0);
    for (near, far, seen) in [(0.0, None, 1.0), (1.9, Some(2.1), 1.0), (2.1, None, 0.0), (0.0, Some(1.9), 0.0)] {
        let rendered = set.render(&View { near, far, ..view }, crate::render::options(4, 0), 1);
        assert!(rendered.direct.iter().all(|&direct| direct == Vec3::splat(seen)), "{near} {far:?}");
    }
}
