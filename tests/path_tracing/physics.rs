//! Closed forms: furnace, form factors, energy.

use crate::brdf::Twin;
use crate::made;
use crate::render::{Set, mean, options, view_along};
use glam::{DVec3, UVec2, Vec3};
use linklight::methods::path_tracing::LightSampling;
use linklight::scene::environment::Environment;
use linklight::scene::{Material, Primitive};
use std::f32::consts::PI;

#[test]
fn the_furnace_fills_by_the_geometric_series() {
    let set = Set::builtin("furnace");
    let view = set.view(None, UVec2::splat(16));
    for bounces in 0..=8 {
        // Reflected rays find the same radiance everywhere: no noise hides an error.
        let mut options = options(16, bounces);
        options.settings.light_sampling = LightSampling::Reflection;
        let rendered = set.render(&view, options, 16);
        let expected = 2.0 - 0.5f32.powi(bounces as i32 + 1);
        let found = mean(&rendered.radiance());
        println!("{bounces} bounces: {found}, expected {expected}");
        assert!(
            (found - expected).abs().max_element() < 2.5e-4 * expected,
            "{bounces} bounces: {found} for {expected}"
        );
    }
}

/// The receiving plate has albedo 1, the sending one radiosity 1: the receiver's mean radiosity is the form factor.
#[test]
fn form_factors_of_squares_are_the_closed_ones() {
    for (name, height, form_factor) in [("parallel-plates", 0.5, 0.199_825), ("perpendicular-plates", 2.0, 0.200_044)] {
        let set = Set::builtin(name);
        let rendered = set.render(&set.view(Some("receiver"), UVec2::splat(32)), options(32, 0), 128);
        let found = PI * mean(&rendered.direct);
        println!("{name}: {found}, expected {form_factor}, {:?}", rendered.estimate);
        assert!((found - form_factor).abs().max_element() < 1e-3, "{name}: {found} for {form_factor}");
        // The error estimate is of the size of the error.
        let estimate = rendered.estimate.unwrap();
        let error = f64::from(found.x / form_factor - 1.0).abs();
        assert!(estimate.relative_mean_error < 5e-3 && error < 5.0 * estimate.relative_mean_error, "{estimate:?}");
        // An orthographic camera straight above a plane: everything about it is known.
        assert!(rendered.depth.iter().all(|depth| (depth - height).abs() < 1e-5));
        assert!(rendered.normal.iter().all(|normal| (*normal - Vec3::Y).length() < 1e-5));
        assert!(rendered.albedo.iter().all(|&albedo| albedo == Vec3::ONE));
    }
}

/// A closed cube of six albedos, one wall shining. All that leaves the walls with one bounce arrives with the next:
/// sum of A B(k) = sum of A E(k + 1), where B(k) = rho E(k).
#[test]
fn every_bounce_carries_what_the_last_one_left() {
    const ALBEDOS: [f32; 6] = [0.9, 0.2, 0.5, 0.7, 0.3, 0.4];
    const EMISSION: f32 = 2.0;
    let mut scene = made::scene_of(made::cube());
    let cube = scene.meshes[0].primitives.remove(0);
    scene.materials.clear();
    for (side, albedo) in ALBEDOS.into_iter().enumerate() {
        let corners = 4 * side..4 * side + 4;
        scene.meshes[0].primitives.push(Primitive {
            positions: cube.positions[corners.clone()].to_vec(),
            // Facing in.
            normals: cube.normals[corners].iter().map(|normal| -normal).collect(),
            triangles: vec![[0, 2, 1], [0, 3, 2]],
            material: side as u32,
            ..Default::default()
        });
        let emission = if side == 0 { Vec3::splat(EMISSION) } else { Vec3::ZERO };
        scene.materials.push(Material { base_color: Vec3::splat(albedo).extend(1.0), emission, ..made::material() });
    }
    let normals: Vec<Vec3> = scene.meshes[0].primitives.iter().map(|wall| wall.normals[0]).collect();
    let set = Set::new(scene, &Environment::default(), true);

    // Mean radiance of each wall by number of reflections.
    let reflections = 5;
    let mut by_reflections = vec![[0.0f64; 6]; reflections + 1];
    for (side, &normal) in normals.iter().enumerate() {
        let view = view_along(Vec3::splat(0.5), -normal, normal.any_orthonormal_vector(), 0.5);
        let mut before = if side == 0 { f64::from(EMISSION) } else { 0.0 };
        by_reflections[0][side] = before;
        for bounces in 0..reflections {
            let rendered = set.render(&view, options(16, bounces as u32), 256);
            let radiance = f64::from(mean(&rendered.radiance()).x);
            by_reflections[bounces + 1][side] = radiance - before;
            before = radiance;
        }
    }
    for k in 0..reflections {
        let left: f64 = by_reflections[k].iter().sum();
        let arrived: f64 = by_reflections[k + 1].iter().zip(ALBEDOS).map(|(l, albedo)| l / f64::from(albedo)).sum();
        println!("after {k} reflections: {left:.5} leaves, {arrived:.5} arrives");
        assert!((arrived / left - 1.0).abs() < 1.2e-2, "after {k} reflections: {left} leaves, {arrived} arrives");
    }
}

#[test]
fn a_closed_door_lets_no_light_through() {
    let set = Set::builtin("two-rooms");
    let lit = set.render(&set.view(Some("main"), UVec2::splat(16)), options(16, 6), 8);
    assert!(mean(&lit.indirect).min_element() > 0.01);
    let dark = set.render(&set.view(Some("dark"), UVec2::splat(48)), options(48, 6), 32);
    assert!(dark.radiance().iter().all(|&radiance| radiance == Vec3::ZERO));
    assert!(dark.depth.iter().all(|&depth| depth > 0.0));
}

/// A GGX metal under a uniform environment reflects its directional albedo, below 1.
#[test]
fn rough_metal_reflects_its_directional_albedo() {
    let to_eye = Vec3::new(0.6, 0.0, 0.8);
    for roughness in [0.2f32, 0.5, 1.0] {
        let mut scene = made::scene_of(made::square());
        scene.materials[0] = Material { metallic: 1.0, roughness, ..made::material() };
        let set = Set::new(scene, &Environment::Constant(Vec3::ONE), false);
        let view = view_along(Vec3::new(0.5, 0.5, 0.0) + 2.0 * to_eye, -to_eye, Vec3::Y, 0.3);
        let twin = Twin {
            albedo: DVec3::ZERO,
            f0: DVec3::ONE,
            f90: 1.0,
            alpha: f64::from(roughness * roughness),
            normal: DVec3::Z,
        };
        let expected = twin.directional_albedo(to_eye.as_dvec3()).as_vec3();
        let found = mean(&set.render(&view, options(16, 0), 256).direct);
        println!("roughness {roughness}: {found}, expected {expected}");
        assert!((found - expected).abs().max_element() < 2e-3, "roughness {roughness}: {found} for {expected}");
        assert!(found.max_element() <= 1.0 && found.min_element() > 0.3);
    }
}
