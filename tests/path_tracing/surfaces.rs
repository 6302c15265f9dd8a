//! What surfaces do to light beside reflecting it: sides, holes, unlit materials, textures, normal maps.

use crate::common::scenes::nearest_texture;
use crate::made;
use crate::render::{Set, looking_down, mean, options};
use glam::{Quat, Vec2, Vec3, Vec4};
use linklight::methods::path_tracing::LightSampling;
use linklight::scene::environment::Environment;
use linklight::scene::{
    Image, Light, LightKind, Material, Mesh, Node, Primitive, Scene, Texture, TextureRef, Transform, Wrap,
};
use std::f32::consts::PI;

/// A matte floor (z = 0, facing up) and a sheet of half its side in the middle above it (z = 0.5, facing up), under
/// directional light of irradiance pi from above: the floor is 1 where light reaches it.
fn sheet_over_floor(sheet: Material) -> Scene {
    let mut scene = made::scene_of(made::square());
    let mut primitive = made::square();
    primitive.material = 1;
    primitive.positions.iter_mut().for_each(|p| *p = (*p * 0.5 + 0.25).with_z(0.5));
    scene.meshes.push(Mesh { primitives: vec![primitive], ..Default::default() });
    scene.nodes.push(Node { mesh: Some(1), ..Default::default() });
    scene.materials.push(sheet);
    scene.lights.push(Light {
        name: String::new(),
        kind: LightKind::Directional,
        intensity: Vec3::splat(PI),
        range: None,
    });
    scene.nodes.push(Node { light: Some(0), ..Default::default() });
    scene
}

/// Sheet and floor beside it, seen from above; then the floor below the sheet, seen from between.
fn seen(scene: Scene, bounces: u32) -> [Vec3; 3] {
    let set = Set::new(scene, &Environment::default(), true);
    let above = |centre: Vec2, height| {
        let rendered = set.render(&looking_down(centre, 0.05, height), options(4, bounces), 64);
        mean(&rendered.radiance())
    };
    [above(Vec2::splat(0.5), 2.0), above(Vec2::splat(0.12), 2.0), above(Vec2::splat(0.5), 0.4)]
}

fn near(found: Vec3, expected: Vec3) -> bool {
    (found - expected).abs().max_element() < 1e-5
}

#[test]
fn a_one_sided_sheet_shows_its_front_and_blocks_with_both() {
    let grey = Vec4::new(0.5, 0.25, 0.75, 1.0);
    let [sheet, floor, below] = seen(sheet_over_floor(Material { base_color: grey, ..made::material() }), 0);
    assert!(near(sheet, grey.truncate()) && near(floor, Vec3::ONE) && below == Vec3::ZERO, "{sheet} {floor} {below}");

    // Turned over, its back is up: black, and still in the way.
    let mut turned = sheet_over_floor(Material { base_color: grey, ..made::material() });
    turned.meshes[1].primitives[0].triangles = vec![[0, 2, 1], [0, 3, 2]];
    turned.meshes[1].primitives[0].normals = vec![Vec3::NEG_Z; 4];
    let [sheet, floor, below] = seen(turned.clone(), 0);
    assert!(sheet == Vec3::ZERO && near(floor, Vec3::ONE) && below == Vec3::ZERO, "{sheet} {floor} {below}");

    // Double-sided, the back reflects as the front does.
    turned.materials[1].double_sided = true;
    let [sheet, ..] = seen(turned, 0);
    assert!(near(sheet, grey.truncate()), "{sheet}");
}

#[test]
fn unlit_surfaces_are_seen_and_block_and_send_nothing() {
    let color = Vec4::new(0.9, 0.3, 0.6, 1.0);
    // Their emission does not count either.
    let unlit = Material { base_color: color, unlit: true, emission: Vec3::splat(50.0), ..made::material() };
    let [sheet, floor, below] = seen(sheet_over_floor(unlit), 3);
    assert!(near(sheet, color.truncate()), "{sheet}");
    assert!(near(floor, Vec3::ONE), "{floor}");
    assert!(below == Vec3::ZERO, "{below}");
}

#[test]
fn light_and_sight_pass_through_holes() {
    let hole = Material { base_color: Vec4::new(1.0, 1.0, 1.0, 0.3), alpha_cutoff: Some(0.5), ..made::material() };
    let [sheet, floor, below] = seen(sheet_over_floor(hole.clone()), 0);
    assert!(near(sheet, Vec3::ONE) && near(floor, Vec3::ONE) && near(below, Vec3::ONE), "{sheet} {floor} {below}");
    // A hole in an emitter sends nothing.
    let glowing = Material { emission: Vec3::splat(100.0), double_sided: true, ..hole };
    let [sheet, floor, below] = seen(sheet_over_floor(glowing), 1);
    assert!(near(sheet, Vec3::ONE) && near(floor, Vec3::ONE) && near(below, Vec3::ONE), "{sheet} {floor} {below}");
}

/// Texture of 2 x 1 texels, left black and right white, read without filter.
fn half_white(scene: &mut Scene) -> TextureRef {
    let rgba = vec![0, 0, 0, 255, 255, 255, 255, 255];
    scene.images.push(Image { name: "halves".into(), width: 2, height: 1, rgba, srgb: true });
    scene.textures.push(nearest_texture(scene.images.len() as u32 - 1));
    let texture = scene.textures.len() as u32 - 1;
    TextureRef { texture, uv_set: 0, transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] }
}

#[test]
fn a_textured_emitter_sends_what_its_texture_shows() {
    let mut scene = sheet_over_floor(Material {
        base_color: Vec4::W,
        emission: Vec3::new(4.0, 2.0, 1.0),
        double_sided: true,
        ..made::material()
    });
    scene.materials[1].emission_texture = Some(half_white(&mut scene));
    scene.lights.clear();
    scene.nodes[2].light = None;
    let set = Set::new(scene, &Environment::default(), true);

    let emission = |x| mean(&set.render(&looking_down(Vec2::new(x, 0.5), 0.02, 2.0), options(4, 0), 4).direct);
    assert_eq!([emission(0.4), emission(0.6)], [Vec3::ZERO, Vec3::new(4.0, 2.0, 1.0)]);

    let floor = |light_sampling| {
        let mut options = options(16, 0);
        options.settings.light_sampling = light_sampling;
        let rendered = set.render(&looking_down(Vec2::splat(0.5), 0.5, 0.4), options, 512);
        // Closer to the white half there is more.
        let side =
            |half: usize| mean(&rendered.direct.chunks(8).skip(half).step_by(2).flatten().copied().collect::<Vec<_>>());
        [side(0), side(1)]
    };
    let [reflection, both] = [floor(LightSampling::Reflection), floor(LightSampling::Both)];
    println!("{reflection:?} {both:?}");
    assert!(both[1].x > 1.3 * both[0].x);
    for (a, b) in reflection.iter().zip(both) {
        assert!((*a / b - 1.0).abs().max_element() < 1e-2, "{a} {b}");
    }
}

/// A normal map that bends normals far over must not let light in from below the surface.
#[test]
fn bent_normals_see_nothing_below_the_surface() {
    let mut scene = made::scene_of(made::square());
    // Tangent-space (0.9, 0, 0.44).
    let rgba = vec![242, 128, 184, 255];
    scene.images.push(Image { name: "bent".into(), width: 1, height: 1, rgba, srgb: false });
    scene.textures.push(Texture {
        image: 0,
        wrap: [Wrap::Repeat; 2],
        mag_linear: true,
        min_linear: true,
        mipmapped: false,
        mip_linear: false,
    });
    let slot = TextureRef { texture: 0, uv_set: 0, transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] };
    scene.materials[0].normal_texture = Some(slot);
    scene.meshes[0].primitives[0].tangents = vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 4];
    scene.lights.push(Light {
        name: String::new(),
        kind: LightKind::Directional,
        intensity: Vec3::splat(PI),
        range: None,
    });
    let lit = |from: Vec3| {
        let mut scene = scene.clone();
        let rotation = Quat::from_rotation_arc(Vec3::Z, from.normalize());
        let transform = Transform::Trs { translation: Vec3::ZERO, rotation, scale: Vec3::ONE };
        scene.nodes.push(Node { light: Some(0), transform, ..Default::default() });
        let set = Set::new(scene, &Environment::default(), true);
        mean(&set.render(&looking_down(Vec2::splat(0.5), 0.4, 1.0), options(4, 0), 4).direct)
    };
    // The bent normal: towards +X it is brighter than straight above, and from below nothing comes though it faces there.
    let bent = Vec3::new(242.0 / 255.0 * 2.0 - 1.0, 128.0 / 255.0 * 2.0 - 1.0, 184.0 / 255.0 * 2.0 - 1.0).normalize();
    let above = lit(Vec3::new(1.0, 0.0, 1.0));
    let expected = bent.dot(Vec3::new(1.0, 0.0, 1.0).normalize());
    assert!((above - expected).abs().max_element() < 1e-4, "{above} for {expected}");
    assert_eq!(lit(Vec3::new(1.0, 0.0, -0.1)), Vec3::ZERO);
    assert!(bent.dot(Vec3::new(1.0, 0.0, -0.1)) > 0.5);
}

/// Vertex colours and the second uv set take part.
#[test]
fn vertex_colours_and_both_uv_sets_count() {
    let mut scene = sheet_over_floor(made::material());
    let slot = half_white(&mut scene);
    scene.materials[1].base_color_texture = Some(TextureRef { uv_set: 1, ..slot });
    let sheet: &mut Primitive = &mut scene.meshes[1].primitives[0];
    // The second set is the first turned round: white on the left.
    sheet.uv[1] = sheet.uv[0].iter().map(|uv| Vec2::ONE - uv).collect();
    sheet.colors = vec![Vec4::new(0.5, 0.25, 1.0, 1.0); 4];
    let set = Set::new(scene, &Environment::default(), true);
    let at = |x| mean(&set.render(&looking_down(Vec2::new(x, 0.5), 0.02, 2.0), options(4, 0), 4).direct);
    assert!(near(at(0.4), Vec3::new(0.5, 0.25, 1.0)) && near(at(0.6), Vec3::ZERO), "{} {}", at(0.4), at(0.6));
}
