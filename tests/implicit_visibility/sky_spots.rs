//! A sun over a plane with a box on it: which elements see it by their bins, against a plain twin and against rays.

use crate::common::TestContext;
use crate::common::scenes::{lambert, one_sided_box, parallelogram, scene};
use crate::fixture::{Fixture, solve};
use crate::shadows::{Seen, winners_around};
use crate::twins;
use glam::{DVec3, Quat, Vec2, Vec3};
use linklight::gpu::shaders::types::Ray;
use linklight::methods::implicit_visibility::{Settings, bins};
use linklight::scene::Material;
use linklight::scene::environment::{Environment, EnvironmentMap};
use linklight::scene::pose::Pose;
use linklight::stages::trace::{self, Tracer};

/// An even sky with a glow about a sun of one texel.
fn sunny() -> EnvironmentMap {
    let (width, height) = (512, 256);
    let blank = EnvironmentMap { width, height, texels: Vec::new(), rotation: 0.0 };
    let place =
        |i: u32| Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5) / Vec2::new(width as f32, height as f32);
    let sun = 70 * width + 330;
    let towards = blank.direction_of(place(sun));
    let texel = |i: u32| Vec3::new(0.2, 0.3, 0.5) + blank.direction_of(place(i)).dot(towards).max(0.0).powi(40);
    let mut texels: Vec<Vec3> = (0..width * height).map(texel).collect();
    texels[sun as usize] += 3e4;
    EnvironmentMap { texels, ..blank }
}

fn box_on_a_plane(context: &TestContext) -> Fixture {
    let mut parts = one_sided_box(Vec3::new(-0.6, 0.0, -0.6), Vec3::new(0.6, 1.2, 0.6), 5);
    parts.push(parallelogram(Vec3::new(-3.0, 0.0, 3.0), Vec3::X * 6.0, Vec3::NEG_Z * 6.0, 32, 0));
    let material = Material { double_sided: false, ..lambert(Vec3::splat(0.5)) };
    Fixture::posed(context, scene(vec![material], parts, &[]), None, Environment::Map(sunny()), Pose::rest)
}

/// Twins of `see_sky` and of `light_of_spots`.
#[test]
fn bright_spots_are_hidden_by_the_surfaces_of_winners() {
    let context = TestContext::new();
    let fixture = box_on_a_plane(&context);
    let settings = Settings { bins: 6, sky_spots: 40, ..Settings::default() };
    let method = fixture.linked(&context, settings);
    let (spots, words) = (context.download(method.sky_spots().0).unwrap(), context.download(method.sky_spots().1));
    let words = words.unwrap();
    let seen = Seen::new(&context, &fixture, &method);
    let direct = solve(&context, &method, &fixture.world, 0).direct;
    let (vectors, solid) = (bins::vectors(6), 4.0 * std::f64::consts::PI / 216.0);
    let radiance = bins::radiance(&fixture.environment.split(40, solid).1, 6);
    let [mut visible, mut hidden, mut differing] = [0; 3];
    for (leaf, at) in seen.receivers.iter().enumerate() {
        let frame = Quat::from_array(at.frame).inverse();
        let element = method.trees().topology.leaf_elements[leaf] as usize;
        let weights = twins::weights(at.normal, &vectors);
        let empty = seen.rows[leaf].iter().zip(&weights).zip(&radiance).filter(|((w, _), _)| **w == twins::EMPTY);
        let mut expected: DVec3 = empty.map(|((_, weight), radiance)| radiance.as_dvec3() * *weight).sum();
        for (k, spot) in spots.iter().enumerate() {
            let is_seen = words[element * spots.len().div_ceil(32) + k / 32] >> (k % 32) & 1 != 0;
            let cosine = at.normal.dot(spot.direction);
            if cosine <= 0.0 {
                assert!(!is_seen, "leaf {leaf} sees spot {k} behind it");
                continue;
            }
            let nodes = winners_around(&seen.rows[leaf], frame * spot.direction, 6);
            let is_crossed = seen.is_crossed(&nodes, 8, at.origin, 1e4 * spot.direction);
            differing += u32::from(is_seen == is_crossed);
            *(if is_seen { &mut visible } else { &mut hidden }) += 1;
            expected += spot.irradiance.as_dvec3() * f64::from(if is_seen { cosine } else { 0.0 });
        }
        let found = direct[element].as_dvec3();
        // Elements below the box take light from their neighbours.
        let is_covered = at.normal.y > 0.5 && at.origin.y < 0.01 && at.origin.abs().max_element() < 0.7;
        assert!(is_covered || (found - expected).length() < 1e-4 * expected.length() + 1e-4, "{found} for {expected}");
    }
    println!("{} spots: {visible} visible, {hidden} hidden, {differing} differ", spots.len());
    // What the bins name is searched as a whole: near the rims of the box it is not all below the nodes they name.
    assert!(differing * 2000 < visible + hidden && visible > 1000 && hidden > 300);
}

/// Shadows of a sun are those of rays, and far better than through the bins.
#[test]
fn a_sun_casts_the_shadow_that_rays_find() {
    let context = TestContext::new();
    let fixture = box_on_a_plane(&context);
    let errors = [4, 8, 12].map(|n| {
        let method = fixture.linked(&context, Settings { bins: n, ..Settings::default() });
        let spots = context.download(method.sky_spots().0).unwrap();
        let words = context.download(method.sky_spots().1).unwrap();
        let receivers = context.download(&method.linking().receivers).unwrap();
        let ray = |at: Vec3, direction: Vec3| Ray { origin: at, t_min: 0.0, direction, t_max: f32::MAX };
        let rays: Vec<Ray> =
            receivers.iter().flat_map(|at| spots.iter().map(move |spot| ray(at.origin, spot.direction))).collect();
        let buffer = context.upload("rays", &rays).unwrap();
        let free = context.buffer::<u32>("free", rays.len()).unwrap();
        let mut recorder = context.recorder("test").unwrap();
        trace::any_hit(&mut recorder, &Tracer::compute(&fixture.bvh, &fixture.world), &buffer, &free, rays.len());
        recorder.submit().unwrap();
        let free = context.download(&free).unwrap();
        let [mut all, mut lost, mut leaked] = [0.0; 3];
        for (leaf, at) in receivers.iter().enumerate() {
            let element = method.trees().topology.leaf_elements[leaf] as usize;
            for (k, spot) in spots.iter().enumerate() {
                let light = f64::from(at.normal.dot(spot.direction).max(0.0) * spot.irradiance.y);
                let is_seen = words[element * spots.len().div_ceil(32) + k / 32] >> (k % 32) & 1 != 0;
                let is_free = free[leaf * spots.len() + k] != 0;
                all += if is_free { light } else { 0.0 };
                lost += if is_free && !is_seen { light } else { 0.0 };
                leaked += if !is_free && is_seen { light } else { 0.0 };
            }
        }
        println!("N = {n}: {} spots, lost {:.2e}, leaked {:.2e}", spots.len(), lost / all, leaked / all);
        (lost / all, leaked / all)
    });
    // Of flat parts in rows the bins name all that hides, however few they are.
    assert!(errors.iter().all(|&(lost, leaked)| lost < 1e-3 && leaked < 1e-4), "{errors:?}");
}
