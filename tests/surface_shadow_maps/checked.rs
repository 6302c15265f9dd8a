//! The final gather by maps, by maps with rays where they leave doubt, and by rays.

use crate::common::TestContext;
use crate::common::scenes::{lambert, light, parallelogram, scene};
use crate::fixture::{Fixture, Shown, builtin_scene};
use glam::{UVec2, Vec3};
use linklight::display::final_gather::{self, Visibility};
use linklight::methods::surface_shadow_maps::{Settings, SurfaceShadowMaps, TexelVisibility};
use linklight::scene::environment::Environment;
use linklight::scene::{LightKind, Material};
use linklight::stages::surface_maps::Sequence;

/// Maps so coarse that they err much, one for texels up to `map_sharing` texels apart.
fn prepared(context: &TestContext, name: &str, bounces: u32, map_sharing: f32) -> (Fixture, SurfaceShadowMaps) {
    let fixture = Fixture::new(context, builtin_scene(name), &Environment::default());
    let (atlas_resolution, map_resolution) = (32, 16);
    let settings = Settings { atlas_resolution, map_resolution, map_sharing, keep_maps: false, ..Settings::default() };
    let method = fixture.prepare(context, settings);
    fixture.solve(context, &method, bounces);
    (fixture, method)
}

fn show(
    context: &TestContext,
    (fixture, method): &(Fixture, SurfaceShadowMaps),
    gather_visibility: Visibility,
    gather_map_reach: f32,
) -> Shown {
    // Maps alone, where they are not checked.
    let gather_map_stretch = 0.0;
    let settings =
        final_gather::Settings { gather_visibility, gather_map_reach, gather_map_stretch, ..Default::default() };
    fixture.show(context, method, settings, UVec2::new(48, 48))
}

#[test]
fn rays_where_maps_leave_doubt_mend_most_of_their_error() {
    let context = TestContext::new();
    let prepared = prepared(&context, "cornell-box", 1, 0.0);
    let rays = show(&context, &prepared, Visibility::Rays, 4.0);
    let maps = show(&context, &prepared, Visibility::Maps, 4.0);
    let checked = show(&context, &prepared, Visibility::Checked, 4.0);
    println!("rays: {}", rays.report);
    println!("maps: off by {:.4}; {}", maps.off(&rays), maps.report);
    println!("checked: off by {:.4}; {}", checked.off(&rays), checked.report);
    assert_eq!(maps.report.mean_rays, 0.0, "a box without a sky asks maps alone");
    assert!(maps.off(&rays) > 0.01, "maps that never err would tell nothing");
    assert!(checked.off(&rays) < 0.5 * maps.off(&rays));
    assert!(checked.report.mean_rays > 1.0 && checked.report.mean_rays < 0.7 * rays.report.mean_rays);

    // A farther reach leaves less to the maps; one that holds all leaves nothing, and the picture is that of rays.
    let far = show(&context, &prepared, Visibility::Checked, 12.0);
    assert!(far.report.mean_rays > checked.report.mean_rays);
    let all = show(&context, &prepared, Visibility::Checked, 1000.0);
    println!("checked without maps: off by {:.2e}; {}", all.off(&rays), all.report);
    assert!(all.off(&rays) < 1e-5 && (all.report.mean_rays / rays.report.mean_rays - 1.0).abs() < 1e-4);
    assert!(show(&context, &prepared, Visibility::Checked, 4.0).indirect == checked.indirect, "the same to the bit");
}

/// A lamp behind a wall: pixels of maps are wider than what lies at the wall's foot, and see it from both sides. Short rays
/// at the surface's end keep both the picture and the texels dark; the light on the lamp's side stays.
#[test]
fn what_lies_close_behind_a_wall_stays_dark() {
    let context = TestContext::new();
    let lamp = Material { emission: Vec3::splat(5.0), ..lambert(Vec3::ZERO) };
    let primitives = vec![
        parallelogram(Vec3::new(-4.0, 0.0, 4.0), Vec3::X * 8.0, Vec3::NEG_Z * 8.0, 1, 0),
        parallelogram(Vec3::new(0.0, 0.0, -4.0), Vec3::Y * 2.0, Vec3::Z * 8.0, 1, 0),
        parallelogram(Vec3::new(-3.0, 0.1, -1.0), Vec3::Y * 1.5, Vec3::Z * 2.0, 1, 1),
    ];
    let materials = vec![lambert(Vec3::splat(0.7)), lamp];
    let fixture = Fixture::new(&context, scene(materials, primitives, &[]), &Environment::default());
    let lit_by = |sequence, map_stretch: f32, visibility, gather_visibility| {
        let settings =
            Settings { atlas_resolution: 48, map_resolution: 16, map_stretch, visibility, sequence, ..no_cache() };
        let method = fixture.prepare(&context, settings);
        fixture.solve(&context, &method, 0);
        let settings =
            final_gather::Settings { gather_visibility, gather_map_stretch: map_stretch, ..Default::default() };
        let shown = fixture.show(&context, &method, settings, UVec2::new(64, 40));
        let texels = context.download(method.direct_irradiance()).unwrap();
        let sides = [-1.0, 1.0].map(|side| {
            let of_side = method.atlas.texels.iter().zip(&texels).filter(|(texel, _)| side * texel.position.x > 0.02);
            of_side.map(|(texel, light)| texel.area * light.x).sum::<f32>()
        });
        (shown, sides)
    };
    let lit = |map_stretch, visibility, gather| lit_by(Sequence::Spiral, map_stretch, visibility, gather);
    let (rays, [lit_by_rays, dark_by_rays]) = lit(1.0, TexelVisibility::Rays, Visibility::Rays);
    let leak = |shown: &Shown| {
        let dark = shown.direct.iter().zip(&rays.direct).filter(|(_, rays)| **rays == Vec3::ZERO);
        dark.map(|(light, _)| light.x).sum::<f32>()
    };
    let (alone, [_, dark_alone]) = lit(0.0, TexelVisibility::Maps, Visibility::Maps);
    let (maps, [lit_by_maps, dark_by_maps]) = lit(1.0, TexelVisibility::Maps, Visibility::Maps);
    let (checked, _) = lit(1.0, TexelVisibility::Maps, Visibility::Checked);
    let (by_sight, _) = lit_by(Sequence::Sight, 1.0, TexelVisibility::Maps, Visibility::Maps);
    println!("texels behind the wall: rays {dark_by_rays}, maps alone {dark_alone}, with short rays {dark_by_maps} W");
    println!("before it: rays {lit_by_rays}, maps {lit_by_maps} W");
    let [alone, short, checked, by_sight] = [&alone, &maps, &checked, &by_sight].map(leak);
    println!("picture: maps alone {alone}, with short rays {short} (in order of sight {by_sight}), checked {checked}");
    // Texels across the wall's foot are lit on one side.
    assert!(dark_alone > 0.1 + 10.0 * dark_by_rays && dark_by_maps - dark_by_rays < 0.06 * dark_alone);
    // Texels look after what is near and no farther: the rest is the maps' word.
    assert!((lit_by_maps / lit_by_rays - 1.0).abs() < 0.02 && lit_by_maps != lit_by_rays);
    assert!(alone > 0.1 && short < 0.08 * alone && checked < 0.02 * alone);
    // Depths that hold for more maps.
    assert!(by_sight < 0.25 * alone);
    assert!(maps.report.mean_rays < rays.report.mean_rays);
}

fn no_cache() -> Settings {
    Settings { keep_maps: false, ..Settings::default() }
}

/// Half of the maps do with twice the error, and what is checked doubts them as far as they stand from what they see for.
#[test]
fn texels_that_share_maps_see_nearly_as_well() {
    let context = TestContext::new();
    let [own, shared] = [0.0, 1.2].map(|sharing| prepared(&context, "cornell-box", 1, sharing));
    let [own_maps, shared_maps] = [&own, &shared].map(|prepared| prepared.1.report().maps);
    let [rays, maps, checked] =
        [Visibility::Rays, Visibility::Maps, Visibility::Checked].map(|by| show(&context, &shared, by, 4.0));
    let unshared = show(&context, &own, Visibility::Maps, 4.0).off(&show(&context, &own, Visibility::Rays, 4.0));
    let [off, checked_off] = [&maps, &checked].map(|shown| shown.off(&rays));
    println!("{own_maps} maps are off by {unshared:.4}, {shared_maps} by {off:.4}, checked by {checked_off:.4}");
    assert!(shared_maps * 4 < own_maps * 3, "{shared_maps} of {own_maps}");
    assert!(off < 3.0 * unshared && off != unshared && checked_off < 0.6 * off);
}

/// A closed room of albedo 1/2 that emits 1 everywhere, seen through maps: pi / 2^k again and again.     [common ground]
#[test]
fn the_furnace_is_even_through_maps() {
    let context = TestContext::new();
    let prepared = prepared(&context, "furnace", 1, 0.0);
    for visibility in [Visibility::Maps, Visibility::Checked] {
        let shown = show(&context, &prepared, visibility, 4.0);
        let mean = |values: &[Vec3]| values.iter().map(|v| f64::from(v.x)).sum::<f64>() / values.len() as f64;
        let (direct, indirect) = (mean(&shown.direct), mean(&shown.indirect));
        println!("{visibility:?}: direct {direct:.4}, indirect {indirect:.4}; {}", shown.report);
        // Emitted, and reflected once; reflected twice and three times.
        assert!((direct / 1.5 - 1.0).abs() < 0.02 && (indirect / 0.375 - 1.0).abs() < 0.02);
    }
}

/// A floor and a wall of two large triangles each, about the origin: nothing is in any way, and a ray that ends on a surface
/// does not meet that surface, however small the coordinates are where it ends.
#[test]
fn nothing_shadows_itself_about_the_origin() {
    let context = TestContext::new();
    let material = Material { double_sided: false, ..lambert(Vec3::splat(0.7)) };
    let floor = parallelogram(Vec3::new(-3.0, 0.0, 3.0), Vec3::X * 6.0, Vec3::NEG_Z * 6.0, 1, 0);
    let wall = parallelogram(Vec3::new(-3.0, -1.0, -1.0), Vec3::X * 6.0, Vec3::Y * 4.0, 1, 0);
    let lamp = (light(LightKind::Point, 20.0), Vec3::new(0.3, 4.0, 0.5), Vec3::NEG_Y);
    let fixture = Fixture::new(&context, scene(vec![material], vec![floor, wall], &[lamp]), &Environment::default());
    let settings = Settings { atlas_resolution: 64, visibility: TexelVisibility::Rays, ..Settings::default() };
    let method = fixture.prepare(&context, settings);
    fixture.solve(&context, &method, 0);
    let show = |gather_visibility| {
        let settings = final_gather::Settings { gather_visibility, gather_threshold: 0.0, ..Default::default() };
        fixture.show(&context, &method, settings, UVec2::new(48, 30))
    };
    let [rays, none] = [Visibility::Rays, Visibility::None].map(show);
    let shadowed = rays.indirect.iter().zip(&none.indirect).filter(|(rays, none)| rays != none).count();
    println!("{shadowed} of {} pixels are shadowed by what they see; {}", rays.report.pixels, rays.report);
    assert!(rays.report.mean_rays > 100.0 && shadowed == 0, "{shadowed}");
}
