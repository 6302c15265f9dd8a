//! Texels that send by direction: their kernels against plain loops, a furnace of metal, a highlight against its integral.

use crate::common::hemisphere_bins::{cosine, decode_32, middle, solid_angle};
use crate::common::lobe::{brdf, diffuse_albedo, specular_albedo};
use crate::common::scenes::{lambert, light, parallelogram, scene};
use crate::common::{Random, TestContext};
use crate::fixture::{Fixture, builtin_scene};
use glam::{DVec3, Vec3};
use linklight::gpu::shaders::methods::surface_shadow_maps::{
    ReflectGloss, ReflectGlossParams, Reflectances, ReflectancesParams,
};
use linklight::gpu::shaders::types::TexelGloss;
use linklight::methods::surface_shadow_maps::{Settings, TexelVisibility};
use linklight::scene::environment::Environment;
use linklight::scene::{LightKind, Material};
use linklight::stages::shiny_texels::{ShinyTexels, ShinyTexelsError};
use linklight::stages::texels::Texels;
use std::f64::consts::PI;

/// Mean over the hemisphere of what a surface reflects of even light.
fn mean(albedo: impl Fn(f64) -> DVec3) -> DVec3 {
    let cosines = (0..1000).map(|k| (f64::from(k) + 0.5) / 1000.0);
    cosines.map(|cosine| 2.0 * cosine * albedo(cosine) / 1000.0).sum()
}

fn gloss_of(random: &mut Random) -> TexelGloss {
    let f0 = Vec3::new(random.unit(), random.unit(), 0.04);
    TexelGloss { f0, f90: 1.0, alpha: 0.02 + 0.9 * random.unit() }
}

#[test]
fn lobes_are_laid_over_bins_as_plain_loops_say() {
    let context = TestContext::new();
    let random = &mut Random(12);
    let (side, texel_count) = (5, 7u32);
    let gloss: Vec<TexelGloss> = (0..texel_count).map(|_| gloss_of(random)).collect();
    let glossy_texels = [4u32, 0, 6];
    let bins = side * side;
    let mut light = |share: u32| match random.below(share) {
        0 => Vec3::new(random.unit(), random.unit(), 3.0 * random.unit()),
        _ => Vec3::ZERO,
    };
    let arrived: Vec<Vec3> = (0..3 * bins).map(|_| light(3)).collect();
    let entries = arrived.len();
    let sent = context.buffer::<u32>("test/sent", entries).unwrap();
    let sent_sum = context.upload("test/sent sum", &vec![0u32; entries]).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    for _ in 0..2 {
        let pass = ReflectGloss {
            glossy_texels: &context.upload("test/texels", &glossy_texels).unwrap(),
            gloss: &context.upload("test/gloss", &gloss).unwrap(),
            arrived: &context.upload("test/arrived", &arrived).unwrap(),
            sent: &sent,
            sent_sum: &sent_sum,
            params: ReflectGlossParams { row_count: 3, side },
        };
        recorder.dispatch(&pass, entries);
    }
    recorder.submit().unwrap();
    let [sent, sum] = [sent, sent_sum].map(|buffer| context.download(&buffer).unwrap());
    let cosines: Vec<f64> = (0..bins).map(|bin| cosine(bin, side)).collect();
    let twin = |row: usize, bin: u32, alpha_factor: f64| {
        let g = &gloss[glossy_texels[row] as usize];
        let (f0, f90) = (g.f0.as_dvec3(), f64::from(g.f90));
        let alpha = (f64::from(g.alpha) * alpha_factor).max(0.6 / f64::from(side));
        let along = middle(bin, side);
        let (mut sum, mut weights) = (DVec3::ZERO, DVec3::ZERO);
        for from in 0..bins {
            let towards = middle(from, side);
            let weight = brdf(f0, f90, alpha, DVec3::Z, along, towards);
            sum += weight * arrived[row * bins as usize + from as usize].as_dvec3();
            weights += weight * cosines[from as usize] * solid_angle(side);
        }
        specular_albedo(f0, f90, alpha, along.z) * sum / weights
    };
    let mut differ = 0;
    for (i, (&word, &sum_word)) in (0..).zip(sent.iter().zip(&sum)) {
        let (row, bin) = (i / bins as usize, i as u32 % bins);
        let expected = twin(row, bin, 1.0);
        // Mantissas of eight bits, and a sum that was rounded twice.
        let near = |got: DVec3, expected: DVec3, bits: f64| {
            (got - expected).abs().max_element() <= bits / 256.0 * expected.max_element()
        };
        let [got, twice] = [word, sum_word].map(decode_32);
        assert!(near(got, expected, 1.1), "row {row}, bin {bin}: {got} for {expected}");
        assert!(near(twice, 2.0 * expected, 3.0), "row {row}, bin {bin}: {twice} for twice {expected}");
        differ += u32::from(!near(got, twin(row, bin, 1.5), 1.1));
    }
    assert!(differ > 20, "a rougher lobe would go unnoticed");
}

#[test]
fn reflectances_are_means_over_the_hemisphere() {
    let context = TestContext::new();
    let random = &mut Random(5);
    let count = 65;
    let mut gloss: Vec<TexelGloss> = (0..count).map(|_| gloss_of(random)).collect();
    gloss[3] = TexelGloss { f0: Vec3::ZERO, f90: 0.0, alpha: 1.0 };
    let albedo: Vec<Vec3> = (0..count).map(|_| Vec3::new(random.unit(), random.unit(), 0.5)).collect();
    let rows: Vec<u32> = (0..count).map(|i| i % 2).collect();
    let [reflectance, evenly] =
        ["test/reflectance", "test/evenly"].map(|name| context.buffer::<Vec3>(name, count as usize).unwrap());
    let pass = Reflectances {
        albedo: &context.upload("test/albedo", &albedo).unwrap(),
        gloss: &context.upload("test/gloss", &gloss).unwrap(),
        glossy_rows: &context.upload("test/rows", &rows).unwrap(),
        reflectance: &reflectance,
        sent_evenly: &evenly,
        params: ReflectancesParams { texel_count: count },
    };
    let mut recorder = context.recorder("test").unwrap();
    recorder.dispatch(&pass, count);
    recorder.submit().unwrap();
    let [reflectance, evenly] = [reflectance, evenly].map(|buffer| context.download(&buffer).unwrap());
    for i in 0..count as usize {
        let (f0, f90, alpha) = (gloss[i].f0.as_dvec3(), f64::from(gloss[i].f90), f64::from(gloss[i].alpha));
        let diffuse = mean(|cosine| diffuse_albedo(albedo[i].as_dvec3(), f0, f90, cosine));
        let all = diffuse + mean(|cosine| specular_albedo(f0, f90, alpha, cosine));
        let off = |got: Vec3, expected: DVec3| (got.as_dvec3() - expected).abs().max_element();
        assert!(off(reflectance[i], all) < 4e-3, "texel {i}: {} for {all}", reflectance[i]);
        let sent = if rows[i] == 0 { all } else { diffuse };
        assert!(off(evenly[i], sent) < 4e-3, "texel {i}: {} for {sent}", evenly[i]);
    }
    assert_eq!(evenly[3], albedo[3], "what has no lobe reflects its albedo");
}

/// A closed room of metal that emits 1 everywhere: whatever a lobe sends where, its share of even light arrives in the mean.
#[test]
fn a_furnace_of_metal_keeps_its_lobes_share() {
    let context = TestContext::new();
    let roughness = 0.5f32;
    let mut scene = builtin_scene("furnace");
    scene.materials.iter_mut().for_each(|material| (material.metallic, material.roughness) = (1.0, roughness));
    let f0 = scene.materials[0].base_color.truncate().as_dvec3();
    let fixture = Fixture::shiny(&context, scene, &Environment::default());
    let expected = PI * mean(|cosine| specular_albedo(f0, 1.0, f64::from(roughness * roughness), cosine)).x;
    for glossy_bins in [0, 8] {
        let settings =
            Settings { atlas_resolution: 32, visibility: TexelVisibility::Rays, glossy_bins, ..Settings::default() };
        let method = fixture.prepare(&context, settings);
        fixture.solve(&context, &method, 1);
        let last = context.download(method.last_irradiance()).unwrap();
        let areas = method.atlas.texels.iter().map(|texel| f64::from(texel.area));
        let (sum, area) = (last.iter().zip(areas))
            .fold((0.0, 0.0), |(sum, all), (e, area)| (sum + f64::from(e.x) * area, all + area));
        println!("{glossy_bins} bins: {:.4} of the lobe's share", sum / area / expected);
        assert!((sum / area / expected - 1.0).abs() < 0.01, "{glossy_bins} bins: {} for {expected}", sum / area);
    }
}

/// A point light's highlight on a metal floor, thrown on a wall: against the integral over the floor, and the light in the
/// tables against the irradiance that it is.
#[test]
fn metal_throws_a_highlight_where_its_integral_has_it() {
    let context = TestContext::new();
    let (roughness, at) = (0.5f32, Vec3::new(0.0, 1.0, 1.0));
    let metal = Material { metallic: 1.0, roughness, double_sided: false, ..lambert(Vec3::ONE) };
    let wall = Material { double_sided: false, ..lambert(Vec3::splat(0.5)) };
    let surfaces = vec![
        parallelogram(Vec3::new(-1.0, 0.0, 1.0), Vec3::X * 2.0, Vec3::NEG_Z * 2.0, 1, 0),
        parallelogram(Vec3::new(-1.0, 0.0, -1.5), Vec3::X * 2.0, Vec3::Y * 2.0, 1, 1),
    ];
    let lamp = (light(LightKind::Point, 7.0), at, Vec3::NEG_Y);
    let sky = Environment::Constant(Vec3::splat(0.25));
    let fixture = Fixture::shiny(&context, scene(vec![metal, wall], surfaces, &[lamp]), &Environment::default());
    let alpha = f64::from(roughness * roughness);
    let off = |glossy_bins| {
        let settings = Settings {
            atlas_resolution: 32,
            visibility: TexelVisibility::Rays,
            threshold: 0.0,
            glossy_bins,
            gloss_threshold: 0.2,
            ..Settings::default()
        };
        let method = fixture.prepare(&context, settings);
        fixture.solve(&context, &method, 1);
        let last = context.download(method.last_irradiance()).unwrap();
        let (floor, walls): (Vec<_>, Vec<_>) =
            method.atlas.texels.iter().zip(&last).partition(|(texel, _)| texel.normal.y > 0.5);
        let (mut error, mut sum) = (0.0, 0.0);
        for (texel, found) in &walls {
            let arriving = |from: &Vec3, area: f32| {
                let (point, from) = (texel.position.as_dvec3(), from.as_dvec3());
                let (to_light, along) = (at.as_dvec3() - from, point - from);
                let lit = 7.0 * to_light.normalize().y / to_light.length_squared();
                let lobe = brdf(DVec3::ONE, 1.0, alpha, DVec3::Y, along.normalize(), to_light.normalize()).x;
                let cosines = along.normalize().y * -along.normalize().dot(texel.normal.as_dvec3());
                lit * lobe * cosines * f64::from(area) / along.length_squared()
            };
            let expected: f64 = floor.iter().map(|(sender, _)| arriving(&sender.position, sender.area)).sum();
            error += (f64::from(found.x) - expected).powi(2);
            sum += expected.powi(2);
        }
        (error / sum).sqrt()
    };
    let [found, even] = [10, 0].map(off);
    println!("off by {found:.3} of the integral, evenly sent light by {even:.3}");
    assert!(found < 0.15 && even > 2.0 * found, "{found} {even}");

    // The same light twice: as irradiance, and along bins.
    let fixture = Fixture::shiny(&context, fixture.scene.clone(), &sky);
    let atlas = fixture.atlas(16);
    let texels = Texels::new(&context, &atlas, &fixture.world, 1e-4).unwrap();
    let shiny = ShinyTexels::find(&context, &texels, &atlas, [8.0, 0.2]).unwrap();
    let floor = atlas.texels.iter().filter(|texel| texel.normal.y > 0.5).count();
    assert_eq!(shiny.row_count as usize, floor, "the wall does not shine");
    let irradiance = context.upload("test/irradiance", &vec![Vec3::ZERO; atlas.texels.len()]).unwrap();
    for has_sky in [false, true] {
        let mut recorder = context.recorder("test").unwrap();
        if has_sky {
            texels.add_environment(&mut recorder, &fixture.tracer(), &fixture.world, 64, &irradiance, Some(&shiny));
        } else {
            shiny.clear(&mut recorder);
            texels.add_lights(&mut recorder, &fixture.tracer(), &fixture.world, 8, &irradiance, Some(&shiny));
        }
        recorder.submit().unwrap();
        let [irradiance, arrived] = [&irradiance, &shiny.arrived].map(|buffer| context.download(buffer).unwrap());
        for (index, &row) in shiny.rows.iter().enumerate().filter(|(_, row)| **row > 0) {
            let bins = &arrived[64 * (row as usize - 1)..][..64];
            let sum: f32 = bins.iter().map(|e| e.x).sum();
            assert!((sum / irradiance[index].x - 1.0).abs() < 1e-4, "texel {index}: {sum} for {}", irradiance[index].x);
            let height: f64 = (0..64).map(|bin| middle(bin, 8).z * f64::from(bins[bin as usize].x)).sum();
            let to_light = (at - atlas.texels[index].position).normalize();
            // A lamp's light lies in the bins around it; of a sky two thirds would be the mean height.
            let off = height / f64::from(sum) - f64::from(to_light.y);
            assert!(has_sky || off.abs() < 0.15, "texel {index}: {height} for {sum} along {to_light}");
        }
    }
    let small = ShinyTexels::find(&context, &texels, &atlas, [8.0, 1.5]).unwrap();
    assert_eq!((small.row_count, small.rows.iter().max()), (0, Some(&0)), "no lobe reflects more than all");
    let huge = ShinyTexels::find(&context, &texels, &atlas, [4000.0, 0.2]);
    assert!(matches!(huge, Err(ShinyTexelsError::TooLarge { .. })), "64 million bins for each of {floor} texels");
}
