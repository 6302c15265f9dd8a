//! The solution on the atlas: furnace, closed door, closed forms, determinism, errors.

use crate::common::TestContext;
use crate::common::scenes::{lambert, light, parallelogram, scene};
use crate::fixture::{Fixture, builtin_scene};
use crate::twins;
use glam::{DVec3, Vec3};
use linklight::methods::pick::Pick;
use linklight::methods::surface_shadow_maps::{Settings, Shown, TexelVisibility};
use linklight::scene::environment::Environment;
use linklight::scene::{LightKind, Material};
use linklight::stages::{sender_tree, texels};
use std::f32::consts::PI;

const SMALL: Settings = Settings {
    atlas_resolution: 32,
    atlas_gutter: 0,
    map_resolution: 16,
    sequence: linklight::stages::surface_maps::Sequence::Spiral,
    map_bias: 1.0,
    map_sharing: 0.0,
    map_stretch: 1.0,
    map_until: linklight::stages::surface_maps::MapUntil::Next,
    map_filter: linklight::stages::surface_maps::MapFilter::Drawn,
    sender_filter: linklight::stages::surface_maps::MapFilter::Drawn,
    visibility: TexelVisibility::Rays,
    threshold: 0.02,
    jitter: true,
    chance: 0.0,
    light_samples: 8,
    environment_rays: 64,
    glossy_bounce: true,
    gloss_threshold: 0.1,
    glossy_bins: 8,
    tree_layout: linklight::stages::sender_tree::NodeLayout::Wide,
    tree_normal_weight: 0.25,
    keep_maps: false,
    show: Shown::Light,
    pick: Pick::Nothing,
};

fn one_sided(albedo: f32) -> Material {
    Material { double_sided: false, ..lambert(Vec3::splat(albedo)) }
}

/// A closed room of albedo 1/2 that emits 1 everywhere: the k-th bounce brings pi / 2^k.             [common ground]
#[test]
fn the_furnace_gains_half_of_each_bounce() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("furnace"), &Environment::default());
    for (visibility, tolerance) in [(TexelVisibility::Rays, 0.01), (TexelVisibility::Maps, 0.02)] {
        let method = fixture.prepare(&context, Settings { visibility, ..SMALL });
        println!("{}", method.report());
        let areas: Vec<f32> = method.atlas.texels.iter().map(|texel| texel.area).collect();
        let total: f32 = areas.iter().sum();
        for bounces in 0..=3u32 {
            fixture.solve(&context, &method, bounces);
            let last = context.download(method.last_irradiance()).unwrap();
            let expected = PI / 2f32.powi(bounces as i32);
            let mean = last.iter().zip(&areas).map(|(e, area)| e.x * area).sum::<f32>() / total;
            let worst = last.iter().map(|e| (e.x / expected - 1.0).abs()).fold(0.0, f32::max);
            println!(
                "{visibility:?}, bounce {bounces}: mean off by {:.3} %, worst {:.2} %",
                100.0 * (mean / expected - 1.0),
                100.0 * worst
            );
            assert!(
                (mean / expected - 1.0).abs() < tolerance,
                "{visibility:?}, bounce {bounces}: {mean} for {expected}"
            );
        }
    }
}

/// Every kind of light over a plane: irradiance of each texel by its closed form, and whether it counts as direct light of
/// the atlas or, punctual, apart from it.                                                            [common ground]
#[test]
fn every_kind_of_light_arrives_as_its_closed_form_says() {
    let context = TestContext::new();
    let at = Vec3::new(0.5, 1.5, -0.25);
    let point = |position: Vec3| 7.0 * (at - position).y / (at - position).length().powi(3);
    let (inner_angle, outer_angle) = (0.3f32, 0.5f32);
    let spot = |position: Vec3| {
        let cosine = (at - position).normalize().y;
        let cone = (cosine - outer_angle.cos()) / (inner_angle.cos() - outer_angle.cos());
        point(position) * cone.clamp(0.0, 1.0).powi(2)
    };
    let slanted = Vec3::new(0.6, -0.8, 0.0);
    // A panel of radiance 2 that faces down.
    let panel = parallelogram(at, Vec3::X * 1.2, Vec3::Z * 0.8, 1, 1);
    let panel_leaf = sender_tree::parallelogram(at + Vec3::new(0.6, 0.0, 0.4), Vec3::X * 1.2, Vec3::Z * 0.8);
    let area = |position: Vec3| 2.0 * PI * twins::form_factor(position.as_dvec3(), DVec3::Y, &panel_leaf) as f32;
    let sky = Environment::Constant(Vec3::splat(0.5));
    let black = Environment::default();
    let lamp = |kind, intensity, direction| vec![(light(kind, intensity), at, direction)];
    let spot_kind = LightKind::Spot { inner_angle, outer_angle };
    type Expected<'a> = &'a dyn Fn(Vec3) -> f32;
    let cases: [(&str, Vec<_>, bool, &Environment, Expected<'_>, f32); 5] = [
        ("point", lamp(LightKind::Point, 7.0, Vec3::NEG_Y), false, &black, &point, 0.01),
        // A texel that the cone's border crosses is sampled at 32 points.
        ("spot", lamp(spot_kind, 7.0, Vec3::NEG_Y), false, &black, &spot, 0.1),
        ("directional", lamp(LightKind::Directional, 3.0, slanted), false, &black, &|_| 3.0 * 0.8, 1e-4),
        ("area", vec![], true, &black, &area, 0.01),
        ("environment", vec![], false, &sky, &|_| 0.5 * PI, 1e-4),
    ];
    for (name, lights, has_panel, environment, expected, tolerance) in cases {
        let plane = parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, 1, 0);
        let emitter = Material { emission: Vec3::splat(2.0), ..one_sided(0.0) };
        let is_punctual = !lights.is_empty();
        let surfaces = if has_panel { vec![plane, panel.clone()] } else { vec![plane] };
        let fixture = Fixture::new(&context, scene(vec![one_sided(0.5), emitter], surfaces, &lights), environment);
        let settings = Settings { light_samples: 32, threshold: 0.0, jitter: false, ..SMALL };
        let method = fixture.prepare(&context, settings);
        fixture.solve(&context, &method, 0);
        let found = context.download(method.last_irradiance()).unwrap();
        let direct = context.download(method.direct_irradiance()).unwrap();
        let floor = || method.atlas.texels.iter().zip(&found).filter(|(texel, _)| texel.position.y < 1.0);
        let off = |expected: Expected<'_>| {
            let largest = floor().map(|(texel, _)| expected(texel.position)).fold(0.0, f32::max);
            floor().map(|(t, e)| (e.x - expected(t.position)).abs()).fold(0.0, f32::max) / largest
        };
        println!("{name}: off by {:.2e} of the brightest texel", off(expected));
        assert!(floor().count() > 500 && off(expected) < tolerance, "{name}: {}", off(expected));
        assert!(off(&|position| 0.8 * expected(position)) > tolerance, "{name}: a quarter more would go unnoticed");
        // What display adds per pixel is not in the atlas' own direct light.
        assert_eq!(direct.iter().all(|e| *e == Vec3::ZERO), is_punctual, "{name}");
    }
}

/// Without a threshold a bounce is the sum over all texels; with one, errors grow and cuts shrink.
#[test]
fn a_bounce_is_the_sum_over_all_texels_but_for_the_threshold() {
    let context = TestContext::new();
    let floor = parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, 1, 0);
    let wall = parallelogram(Vec3::new(-2.0, 0.0, -2.0), Vec3::X * 4.0, Vec3::Y * 2.0, 1, 0);
    let ceiling = parallelogram(Vec3::new(-2.0, 2.0, -2.0), Vec3::X * 4.0, Vec3::Z * 4.0, 1, 0);
    let lamp = (light(LightKind::Point, 7.0), Vec3::new(0.5, 1.2, 0.3), Vec3::NEG_Y);
    let scene = scene(vec![one_sided(0.6)], vec![floor, wall, ceiling], &[lamp]);
    let fixture = Fixture::new(&context, scene, &Environment::default());
    let mut before = (0.0, f64::MAX);
    for threshold in [0.0, 0.02, 0.1, 0.5] {
        let method = fixture.prepare(&context, Settings { threshold, jitter: false, ..SMALL });
        fixture.solve(&context, &method, 0);
        let radiosity: Vec<Vec3> =
            context.download(method.last_irradiance()).unwrap().iter().map(|e| 0.6 * e).collect();
        fixture.solve(&context, &method, 1);
        let found = context.download(method.last_irradiance()).unwrap();
        let leaves = texels::leaves(&method.atlas);
        let error = |sent: &[Vec3]| {
            let (mut error, mut sum) = (0.0, 0.0);
            for (texel, found) in method.atlas.texels.iter().zip(&found).step_by(11) {
                let expected = twins::irradiance(texel.position.as_dvec3(), texel.normal.as_dvec3(), &leaves, sent);
                error += found.as_dvec3().distance_squared(expected);
                sum += expected.length_squared();
            }
            (error / sum).sqrt()
        };
        let off = error(&radiosity);
        let cuts = context.download(method.cut_sizes()).unwrap();
        let cut = cuts.iter().map(|&cut| f64::from(cut)).sum::<f64>() / cuts.len() as f64;
        println!("threshold {threshold}: off by {off:.4}, cut {cut:.1} of {} texels", cuts.len());
        if threshold == 0.0 {
            assert!(off < 0.01, "points stand for polygons farther than five radii: {off}");
            let wrong: Vec<Vec3> = radiosity.iter().rev().copied().collect();
            assert!(error(&wrong) > 0.1, "light of other texels would go unnoticed");
        }
        assert!(off > 0.8 * before.0 && cut <= before.1, "{off}, {cut} after {before:?}");
        before = (off, cut);
    }
    assert!(before.0 > 0.01 && before.1 < 60.0, "{before:?}");
}

/// Two rooms and a closed door: with rays the dark room is dark; with maps the leak is what is printed.
#[test]
fn a_closed_door_keeps_light_in() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("two-rooms"), &Environment::default());
    let mut leaks = Vec::new();
    for visibility in [TexelVisibility::Rays, TexelVisibility::Maps] {
        let method = fixture.prepare(&context, Settings { visibility, atlas_resolution: 64, ..SMALL });
        fixture.solve(&context, &method, 2);
        let [direct, indirect] =
            [method.direct_irradiance(), method.indirect_irradiance()].map(|b| context.download(b).unwrap());
        let sum = |is_dark: bool| -> f64 {
            let texels = method.atlas.texels.iter().zip(direct.iter().zip(&indirect));
            let side = texels.filter(|(texel, _)| is_inside(texel.position, texel.normal, is_dark, fixture.bounds));
            side.map(|(texel, (d, i))| f64::from(texel.area * (d.x + i.x))).sum()
        };
        let (dark, lit) = (sum(true), sum(false));
        println!("{visibility:?}: the dark room has {dark:.2e} W of {lit:.2e} W");
        leaks.push(dark / lit);
    }
    assert!(leaks[0] < 1e-6, "{leaks:?}");
    assert!(leaks[1] < 0.02, "{leaks:?}");
}

/// Well inside the one or the other half of the scene, along its longest side.
fn is_inside(position: Vec3, normal: Vec3, is_dark: bool, [low, high]: [Vec3; 2]) -> bool {
    let axis = (high - low).max_position();
    let middle = 0.5 * (low[axis] + high[axis]);
    let inwards = (low.midpoint(high) - position).dot(normal) > 0.0;
    let offset = position[axis] - middle;
    inwards && offset.abs() > 0.1 * (high[axis] - low[axis]) && (offset > 0.0) == is_dark
}

#[test]
fn solutions_are_the_same_to_the_bit_and_maps_come_near_rays() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("cornell-box"), &Environment::default());
    let solve = |visibility| {
        let method = fixture.prepare(&context, Settings { visibility, map_resolution: 32, ..SMALL });
        fixture.solve(&context, &method, 1);
        context.download(method.indirect_irradiance()).unwrap()
    };
    let (maps, again) = (solve(TexelVisibility::Maps), solve(TexelVisibility::Maps));
    assert!(maps == again);
    let rays = solve(TexelVisibility::Rays);
    let error: f32 = maps.iter().zip(&rays).map(|(a, b)| a.distance_squared(*b)).sum();
    let total: f32 = rays.iter().map(|e| e.length_squared()).sum();
    println!("maps against rays: off by {:.2} %", 100.0 * (error / total).sqrt());
    assert!((error / total).sqrt() < 0.1 && error > 0.0);
}

#[test]
fn what_does_not_fit_is_refused_in_words() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("maze"), &Environment::default());
    let stage = fixture.stage(None, &linklight::stages::work::Unwatched);
    let settings = Settings { atlas_resolution: 8, ..SMALL };
    let error = linklight::methods::surface_shadow_maps::SurfaceShadowMaps::prepare(&context, &stage, settings);
    let message = error.err().expect("202 charts do not fit into 8 x 8 texels").to_string();
    assert!(message.contains("charts do not fit") && message.contains("atlas_resolution="), "{message}");
    // One chart fills the atlas.
    let plane = parallelogram(Vec3::ZERO, Vec3::X, Vec3::Z, 1, 0);
    let fixture = Fixture::new(&context, scene(vec![one_sided(0.5)], vec![plane], &[]), &Environment::default());
    let stage = fixture.stage(None, &linklight::stages::work::Unwatched);
    let settings = Settings { atlas_resolution: 264, visibility: TexelVisibility::Maps, ..SMALL };
    let error = linklight::methods::surface_shadow_maps::SurfaceShadowMaps::prepare(&context, &stage, settings);
    let message = error.err().expect("more texels than places").to_string();
    assert!(message.contains("65536") && message.contains("lower atlas_resolution"), "{message}");
}
