//! `atlas/materials`: what texels reflect and emit, against a plain loop over their parts, and textures' known means.

use crate::common::{Random, TestContext};
use crate::compare::{Tolerance, hold, tells_apart};
use crate::materials::{image, jumble, textured};
use glam::{Vec2, Vec3, Vec4};
use linklight::gpu::Context;
use linklight::gpu::shaders::atlas::{Materials, MaterialsParams};
use linklight::gpu::shaders::types::{AtlasPart, AtlasTexel, TexelGloss};
use linklight::scene::atlas::{Atlas, Size};
use linklight::scene::environment::Environment;
use linklight::scene::geometry::Geometry;
use linklight::scene::pose::Pose;
use linklight::scene::{Image, Material, Scene, TextureRef};
use linklight::stages::texels::Texels;
use linklight::stages::world::World;

const TOLERANCE: Tolerance = Tolerance { absolute: 1e-6, relative: 1e-5 };

#[derive(Default)]
struct Means {
    albedo: Vec<Vec3>,
    emission: Vec<Vec3>,
    /// f0, f90 and alpha.
    gloss: Vec<[f32; 5]>,
}

/// The twin, textures apart.
fn means(texels: &[AtlasTexel], parts: &[AtlasPart], geometry: &Geometry, materials: &[Material]) -> Means {
    let mut means = Means::default();
    for texel in texels {
        let (mut albedo, mut emission, mut f0) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
        let (mut f90, mut alpha, mut area) = (0.0, 0.0, 0.0);
        for part in &parts[texel.first_part as usize..][..texel.part_count as usize] {
            let corners = geometry.triangles[part.triangle as usize];
            let [u, v] = part.barycentrics.to_array();
            let weighted = corners.iter().zip([1.0 - u - v, u, v]);
            let color: Vec4 = weighted.map(|(&corner, weight)| weight * geometry.colors[corner as usize]).sum();
            let m =
                &materials[geometry.parts[geometry.triangle_part[part.triangle as usize] as usize].material as usize];
            let base = (m.base_color * color).truncate();
            let is_seen = m.double_sided || texel.is_back == 0;
            emission += if is_seen { part.area * m.emission } else { Vec3::ZERO };
            if is_seen && !m.unlit {
                let dielectric = Vec3::splat(((m.ior - 1.0) / (m.ior + 1.0)).powi(2) * m.specular);
                albedo += part.area * base * (1.0 - m.metallic);
                f0 += part.area * dielectric.lerp(base, m.metallic);
                f90 += part.area * (m.specular + (1.0 - m.specular) * m.metallic);
            }
            alpha += part.area * (m.roughness * m.roughness).max(1e-3);
            area += part.area;
        }
        let inverse = if area > 0.0 { 1.0 / area } else { 0.0 };
        means.albedo.push(albedo * inverse);
        means.emission.push(emission * inverse);
        let f0 = f0 * inverse;
        means.gloss.push([f0.x, f0.y, f0.z, f90 * inverse, alpha * inverse]);
    }
    means
}

fn on_device(context: &Context, world: &World, texels: &[AtlasTexel], parts: &[AtlasPart]) -> Means {
    let count = texels.len();
    let [albedo, emission] = ["test/albedo", "test/emission"].map(|name| context.buffer(name, count).unwrap());
    let gloss = context.buffer::<TexelGloss>("test/gloss", count).unwrap();
    let pass = Materials {
        texels: &context.upload("test/texels", texels).unwrap(),
        parts: &context.upload("test/parts", parts).unwrap(),
        triangles: &world.triangles,
        triangle_materials: &world.triangle_materials,
        attributes: &world.attributes,
        materials: &world.materials,
        positions: &world.positions,
        albedo: &albedo,
        emission: &emission,
        gloss: &gloss,
        textures: &world.textures,
        params: MaterialsParams { texel_count: count as u32 },
    };
    let mut recorder = context.recorder("test").unwrap();
    recorder.dispatch(&pass, count);
    recorder.submit().unwrap();
    let gloss = context.download(&gloss).unwrap();
    Means {
        albedo: context.download(&albedo).unwrap(),
        emission: context.download(&emission).unwrap(),
        gloss: gloss.iter().map(|g| [g.f0.x, g.f0.y, g.f0.z, g.f90, g.alpha]).collect(),
    }
}

#[test]
fn texels_reflect_and_emit_as_a_plain_loop_says() {
    let context = TestContext::new();
    let random = &mut Random(81);
    let mut scene = jumble(40, random);
    for (index, m) in scene.materials.iter_mut().enumerate() {
        m.roughness = 0.3 * index as f32;
        m.specular = 0.5;
        m.ior = 1.3 + 0.2 * index as f32;
        m.double_sided = index == 2;
    }
    let geometry = Geometry::flatten(&scene, 1 << 30).unwrap();
    let world = World::new(&context, &scene, &geometry, &Pose::rest(&scene), &Environment::default(), false).unwrap();
    for count in [1u32, 64, 333] {
        let (mut texels, mut parts) = (Vec::new(), Vec::new());
        for index in 0..count {
            let part_count = if index == 5 { 0 } else { 1 + random.below(4) };
            texels.push(AtlasTexel {
                position: Vec3::ZERO,
                normal: Vec3::Z,
                side_u: Vec3::X,
                side_v: Vec3::Y,
                first_part: parts.len() as u32,
                part_count,
                is_back: index % 2,
            });
            parts.extend((0..part_count).map(|_| AtlasPart {
                triangle: random.below(geometry.triangles.len() as u32),
                barycentrics: 0.5 * Vec2::new(random.unit(), random.unit()),
                area: 0.1 + random.unit(),
            }));
        }
        let expected = means(&texels, &parts, &geometry, &scene.materials);
        let got = on_device(&context, &world, &texels, &parts);
        hold("albedo", &got.albedo, &expected.albedo, TOLERANCE);
        hold("emission", &got.emission, &expected.emission, TOLERANCE);
        hold("gloss", &got.gloss, &expected.gloss, TOLERANCE);
        if count == 333 {
            let turned: Vec<_> = texels.iter().map(|t| AtlasTexel { is_back: 1 - t.is_back, ..*t }).collect();
            let wrong = means(&turned, &parts, &geometry, &scene.materials);
            tells_apart("backs for fronts", &wrong.albedo, &expected.albedo, TOLERANCE);
            tells_apart("backs that emit", &wrong.emission, &expected.emission, TOLERANCE);
            tells_apart("backs that shine", &wrong.gloss, &expected.gloss, TOLERANCE);
        }
    }
}

/// Albedo of a quad's texels, which cut it into at least 8 x 8.
fn texels_of(context: &TestContext, scene: &Scene) -> Vec<(Vec3, Vec3)> {
    let geometry = Geometry::flatten(scene, 1 << 30).unwrap();
    let world = World::new(context, scene, &geometry, &Pose::rest(scene), &Environment::default(), false).unwrap();
    let positions = context.download(&world.positions).unwrap();
    let atlas = Atlas::new(scene, &geometry, &positions, Size::tight(16)).unwrap();
    let texels = Texels::new(context, &atlas, &world, 1e-3).unwrap();
    let albedo = context.download(&texels.albedo).unwrap();
    assert!(albedo.len() >= 64, "{} texels", albedo.len());
    atlas.texels.iter().map(|texel| texel.position).zip(albedo).collect()
}

/// Coordinates of the second set that run over an eighth of the texture, and a transform that makes it the whole; the
/// first set is a point.
fn through_a_transform(image: Image) -> Scene {
    let mut scene = textured(image);
    let transform = [[0.0, 8.0, 0.0], [8.0, 0.0, 0.0]];
    scene.materials[0].base_color_texture = Some(TextureRef { texture: 0, uv_set: 1, transform });
    scene.materials[0].base_color = Vec4::ONE;
    for primitive in scene.meshes.iter_mut().flat_map(|mesh| &mut mesh.primitives) {
        primitive.uv[0].fill(Vec2::splat(0.5));
        primitive.uv[1].iter_mut().for_each(|uv| *uv /= 8.0);
    }
    scene
}

/// A checker of one texel's squares of a texture twice as high as wide.
fn tall(side: u32, texel: impl Fn(u32, u32) -> u8) -> Image {
    let rgba = (0..2 * side * side).flat_map(|i| {
        let value = texel(i % side, i / side);
        [value, value, value, 255]
    });
    Image { name: "test".into(), width: side, height: 2 * side, rgba: rgba.collect(), srgb: false }
}

#[test]
fn a_fine_texture_counts_by_its_mean_over_the_texel() {
    let context = TestContext::new();
    let checker = |x: u32, y: u32| if (x + y).is_multiple_of(2) { 255 } else { 0 };
    let scenes = [
        ("as it is", textured(image(128, false, |x, y| [checker(x, y); 3])), Vec3::new(0.5, 1.0, 0.25)),
        ("through a transform", through_a_transform(tall(128, checker)), Vec3::ONE),
    ];
    for (what, scene, factor) in scenes {
        for (position, albedo) in texels_of(&context, &scene) {
            let off = (albedo - 0.5 * factor).abs().max_element();
            assert!(off < 0.01, "{what}: {albedo} at {position}");
        }
    }
}

#[test]
fn a_coarse_texture_stays_sharp() {
    let context = TestContext::new();
    // Dark for low u, then bright; the transform exchanges u and v.
    let halves = |x: u32, side: u32| if x < side / 2 { 51 } else { 204 };
    let scenes = [
        ("as it is", textured(image(128, false, |x, _| [halves(x, 128); 3])), 0),
        ("through a transform", through_a_transform(tall(128, |x, _| halves(x, 128))), 1),
    ];
    for (what, scene, axis) in scenes {
        let mut sides = [0, 0];
        for (position, albedo) in texels_of(&context, &scene) {
            let at = position[axis];
            if (at - 0.5).abs() > 0.15 && (at - 0.5).abs() < 0.35 {
                let expected = if at < 0.5 { 0.2 } else { 0.8 };
                assert!((albedo.y - expected).abs() < 0.01, "{what}: {albedo} at {position}");
                sides[usize::from(at > 0.5)] += 1;
            }
        }
        assert!(sides[0] > 8 && sides[1] > 8, "{sides:?}");
    }
}
