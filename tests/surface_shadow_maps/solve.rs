//! The solution on the atlas: furnace, closed door, closed forms, determinism, errors.

use crate::common::TestContext;
use crate::common::scenes::{lambert, light, parallelogram, scene};
use crate::fixture::{Fixture, builtin_scene};
use glam::Vec3;
use linklight::methods::pick::Pick;
use linklight::methods::surface_shadow_maps::{Settings, Shown, TexelVisibility};
use linklight::scene::environment::Environment;
use linklight::scene::{LightKind, Material};
use std::f32::consts::PI;

const SMALL: Settings = Settings {
    atlas_resolution: 32,
    map_resolution: 16,
    sequence: linklight::stages::surface_maps::Sequence::Spiral,
    map_bias: 1.0,
    map_filter: linklight::stages::surface_maps::MapFilter::Drawn,
    sender_filter: linklight::stages::surface_maps::MapFilter::Drawn,
    visibility: TexelVisibility::Rays,
    threshold: 0.02,
    jitter: true,
    light_samples: 8,
    environment_rays: 64,
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

/// A point light over a plane: I cos / r^2, mean over each texel.                                    [common ground]
#[test]
fn a_point_light_falls_with_the_square_of_the_distance() {
    let context = TestContext::new();
    let plane = parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, 1, 0);
    let at = Vec3::new(0.5, 1.5, -0.25);
    let lamp = (light(LightKind::Point, 7.0), at, Vec3::NEG_Y);
    let scene = scene(vec![one_sided(0.5)], vec![plane], &[lamp]);
    let fixture = Fixture::new(&context, scene, &Environment::default());
    let method = fixture.prepare(&context, Settings { light_samples: 32, ..SMALL });
    fixture.solve(&context, &method, 0);
    let found = context.download(method.last_irradiance()).unwrap();
    for (texel, irradiance) in method.atlas.texels.iter().zip(&found) {
        let offset = at - texel.position;
        let expected = 7.0 * offset.y / offset.length().powi(3);
        assert!((irradiance.x / expected - 1.0).abs() < 0.01, "{:?}: {irradiance} for {expected}", texel.position);
    }
    assert!(
        context.download(method.direct_irradiance()).unwrap().iter().all(|e| *e == Vec3::ZERO),
        "punctual is apart"
    );
}

#[test]
fn an_even_sky_gives_pi_times_its_radiance() {
    let context = TestContext::new();
    let plane = parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, 1, 0);
    let sky = Environment::Constant(Vec3::new(0.5, 1.0, 2.0));
    let fixture = Fixture::new(&context, scene(vec![one_sided(0.5)], vec![plane], &[]), &sky);
    let method = fixture.prepare(&context, SMALL);
    fixture.solve(&context, &method, 1);
    for irradiance in context.download(method.direct_irradiance()).unwrap() {
        let error = (irradiance / (PI * Vec3::new(0.5, 1.0, 2.0)) - Vec3::ONE).abs().max_element();
        assert!(error < 1e-5, "{irradiance}");
    }
    assert!(context.download(method.indirect_irradiance()).unwrap().iter().all(|e| *e == Vec3::ZERO));
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
    let settings = Settings { atlas_resolution: 512, visibility: TexelVisibility::Maps, ..SMALL };
    let error = linklight::methods::surface_shadow_maps::SurfaceShadowMaps::prepare(&context, &stage, settings);
    let message = error.err().expect("more texels than places").to_string();
    assert!(message.contains("65536") && message.contains("lower atlas_resolution"), "{message}");
}
