//! The glossy bounce of texels towards the eye against its integral.

use crate::common::TestContext;
use crate::common::lobe::specular_albedo;
use crate::fixture::{Fixture, builtin_scene};
use glam::{DVec3, UVec2};
use linklight::display::final_gather;
use linklight::display::final_gather::Gathered;
use linklight::display::g_buffer::GBuffer;
use linklight::display::glossy_texels::GlossyTexels;
use linklight::display::shadow_maps::ShadowMaps;
use linklight::methods::surface_shadow_maps::{Settings, TexelVisibility};
use linklight::report::tonemap::ToneSettings;
use linklight::scene::atlas::NO_TEXEL;
use linklight::scene::camera::View;
use linklight::scene::environment::Environment;

/// A closed room of metal that emits 1 everywhere: texels send what their lobe reflects of even light.
#[test]
fn texels_of_metal_send_their_lobes_share_of_even_light() {
    const ROUGHNESS: f32 = 0.6;
    let context = TestContext::new();
    let mut scene = builtin_scene("furnace");
    scene.materials.iter_mut().for_each(|material| (material.metallic, material.roughness) = (1.0, ROUGHNESS));
    let f0 = scene.materials[0].base_color.truncate().as_dvec3();
    let fixture = Fixture::shiny(&context, scene, &Environment::default());
    let settings = Settings { atlas_resolution: 32, visibility: TexelVisibility::Rays, ..Settings::default() };
    let method = fixture.prepare(&context, settings);
    fixture.solve(&context, &method, 1);
    let view = View::of_scene(&fixture.scene, &fixture.pose, None, Some(fixture.bounds), UVec2::splat(32)).unwrap();
    let (shadow_maps, g_buffer) =
        (ShadowMaps::new(&context, &fixture.pose, [1, 1]).unwrap(), GBuffer::new(&context, 1, 1).unwrap());
    let by = final_gather::Settings { gather_threshold: 0.01, ..Default::default() };
    let glossy = GlossyTexels::new(&context, &method.atlas, by, ToneSettings::default(), 3).unwrap();
    let from = Gathered {
        world: &fixture.world,
        tree: &method.tree,
        tracer: fixture.tracer(),
        maps: None,
        bvh: &fixture.bvh,
        shadow_maps: &shadow_maps,
        g_buffer: &g_buffer,
        view: &view,
    };
    let mut recorder = context.recorder("test").unwrap();
    method.send_before_last(&mut recorder);
    glossy.draw(&mut recorder, &method.texels, from, 4);
    recorder.submit().unwrap();
    let direct = context.download(glossy.gloss().direct).unwrap();
    let indirect = context.download(glossy.gloss().indirect).unwrap();

    let (mut sum, mut expected, mut other) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
    for (place, &texel) in method.atlas.texel_at.iter().enumerate().filter(|(_, texel)| **texel != NO_TEXEL) {
        let texel = &method.atlas.texels[texel as usize];
        let cos_eye = texel.normal.dot((view.position - texel.position).normalize());
        assert!(cos_eye > 0.0, "the eye is inside");
        sum += direct[place].as_dvec3();
        let of = |roughness: f32| specular_albedo(f0, 1.0, f64::from(roughness * roughness), f64::from(cos_eye));
        expected += of(ROUGHNESS);
        other += of(1.0);
    }
    let [energy, wrong] = [expected, other].map(|expected| sum.x / expected.x);
    println!("{energy:.4} of what the lobe reflects, {wrong:.4} of what a rougher one does");
    assert!((energy - 1.0).abs() < 0.02 && (wrong - 1.0).abs() > 0.04);
    // The same light again, reflected once between texels: the lobe's share of even light, of what came straight.
    let total = |light: &[glam::Vec3]| light.iter().map(|light| light.x).sum::<f32>();
    let again = total(&indirect) / total(&direct);
    println!("{again:.3} of it again");
    assert!((0.4..0.7).contains(&again), "{again}");
}
