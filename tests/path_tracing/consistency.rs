//! The reference against itself: the same picture whatever the way light is found, the same bits whatever the batches.

use crate::made;
use crate::render::{Rendered, Set, builtin, mean, options};
use glam::{UVec2, Vec3};
use linklight::methods::path_tracing::{EmitterSampling, LightSampling, Options};
use linklight::scene::Scene;
use linklight::scene::environment::Environment;

fn differs(a: &Rendered, b: &Rendered) -> bool {
    let bits = |values: &[Vec3]| -> Vec<[u32; 3]> { values.iter().map(|v| v.to_array().map(f32::to_bits)).collect() };
    bits(&a.direct) != bits(&b.direct)
        || bits(&a.indirect) != bits(&b.indirect)
        || bits(&a.normal) != bits(&b.normal)
        || a.depth != b.depth
}

#[test]
fn a_picture_is_a_function_of_its_settings() {
    let set = Set::new(builtin("cornell-box"), &Environment::Constant(Vec3::splat(0.1)), false);
    let view = set.view(None, UVec2::splat(20));
    let base = options(20, 2);
    let first = set.render(&view, base, 7);
    assert!(!differs(&first, &set.render(&view, base, 7)), "twice the same");
    // 400 pixels and 7 samples by 64, 1000 and 262144 paths at once: tiles, and samples together.
    for paths_in_flight in [64, 1000] {
        let mut options = base;
        options.settings.paths_in_flight = paths_in_flight;
        assert!(!differs(&first, &set.render(&view, options, 7)), "{paths_in_flight} paths at once");
    }
    assert!(!differs(&first, &set.render_in_steps(&view, base, &[1, 4, 2])), "in three steps");
    assert!(differs(&first, &set.render(&view, Options { seed: 2, ..base }, 7)), "another seed");
}

/// Glossy and matte surfaces, an emitter, an environment and a punctual light.
fn mixed_scene() -> Scene {
    let mut scene = builtin("cornell-box");
    for (index, material) in scene.materials.iter_mut().enumerate() {
        material.roughness = 0.3 + 0.1 * index as f32;
        material.metallic = if index % 2 == 0 { 0.8 } else { 0.0 };
        // Dim walls beside the bright lamp: power and area are different weights.
        material.emission += 0.05;
    }
    scene
}

#[test]
fn all_ways_to_find_light_agree() {
    let set = Set::new(mixed_scene(), &Environment::Constant(Vec3::new(0.5, 1.0, 2.0)), false);
    let view = set.view(None, UVec2::splat(32));
    let render = |light_sampling, emitter_sampling, samples| {
        let mut options = options(32, 2);
        options.settings.light_sampling = light_sampling;
        options.settings.emitter_sampling = emitter_sampling;
        let rendered = set.render(&view, options, samples);
        println!("{light_sampling:?}, {emitter_sampling:?}: {} {:?}", mean(&rendered.radiance()), rendered.estimate);
        rendered
    };
    let both = render(LightSampling::Both, EmitterSampling::Power, 128);
    for other in [
        render(LightSampling::Lights, EmitterSampling::Power, 256),
        render(LightSampling::Reflection, EmitterSampling::Power, 512),
        render(LightSampling::Both, EmitterSampling::Area, 128),
    ] {
        let (a, b) = (both.estimate.unwrap(), other.estimate.unwrap());
        let error = (a.relative_mean_error.powi(2) + b.relative_mean_error.powi(2)).sqrt();
        let deviation = (b.mean / a.mean - 1.0).abs() / error;
        assert!(deviation < 4.0 && error < 0.02, "{} and {} differ by {deviation} errors", a.mean, b.mean);
    }
}

/// Half the variance at twice the samples, or better; and the estimate sees it.
#[test]
fn the_error_estimate_falls_with_samples() {
    let set = Set::builtin("cornell-box");
    let view = set.view(None, UVec2::splat(16));
    let best = set.render(&view, Options { seed: 9, ..options(16, 2) }, 1024);
    let mut last = f64::INFINITY;
    for samples in [4, 16, 64] {
        let rendered = set.render(&view, options(16, 2), samples);
        let estimate = rendered.estimate.unwrap();
        let difference = rendered.radiance().into_iter().zip(best.radiance()).map(|(a, b)| (a - b).length_squared());
        let found = (difference.sum::<f32>() / (3.0 * 256.0)).sqrt() / estimate.mean as f32;
        let ratio = estimate.relative_pixel_error / f64::from(found);
        println!("{samples} samples: estimate {:.4}, found {found:.4}", estimate.relative_pixel_error);
        assert!((0.5..2.0).contains(&ratio), "{samples} samples: estimate {estimate:?}, found {found}");
        assert!(estimate.relative_pixel_error < 0.6 * last);
        last = estimate.relative_pixel_error;
    }
    assert!(set.render(&view, options(16, 2), 1).estimate.is_none());
}

/// Areas of emissive triangles follow the pose: a scaled emitter is drawn, and weighted, as it stands now.
#[test]
fn emitters_follow_the_pose() {
    let mut scene = made::scene_of(made::square());
    let mut square = made::square();
    square.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    square.normals = vec![Vec3::NEG_Z; 4];
    square.material = 1;
    let emission = Vec3::splat(std::f32::consts::FRAC_1_PI);
    scene.materials.push(linklight::scene::Material { emission, base_color: glam::Vec4::W, ..made::material() });
    scene.meshes.push(linklight::scene::Mesh { primitives: vec![square], ..Default::default() });
    let stand = |scale: f32| linklight::scene::Transform::Trs {
        translation: Vec3::new(0.0, 0.0, 1.0),
        rotation: glam::Quat::IDENTITY,
        scale: Vec3::splat(scale),
    };
    scene.nodes.push(linklight::scene::Node { mesh: Some(1), transform: stand(0.25), ..Default::default() });

    let mut moved = scene.clone();
    moved.nodes[1].transform = stand(1.0);
    let moved_pose = linklight::scene::pose::Pose::rest(&moved);
    let set = Set::new(scene, &Environment::default(), true);
    let found = set.render_moved(&moved_pose, &crate::render::looking_down(glam::Vec2::splat(0.5), 0.5, 0.5), 128);
    let form_factor = std::f32::consts::PI * mean(&found.direct);
    assert!((form_factor - 0.199_825).abs().max_element() < 1e-3, "{form_factor}");
}
