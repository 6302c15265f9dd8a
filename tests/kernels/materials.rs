//! `elements/materials` against its twin on untextured materials, and against known means of textures.

use crate::common::scenes::{lambert, parallelogram, scene};
use crate::common::{Random, TestContext};
use crate::compare::{Tolerance, hold, tells_apart};
use glam::{Vec3, Vec4};
use linklight::gpu::Context;
use linklight::gpu::shaders::elements::{Materials, MaterialsParams};
use linklight::scene::adjacency::incident_triangles;
use linklight::scene::environment::Environment;
use linklight::scene::geometry::Geometry;
use linklight::scene::pose::Pose;
use linklight::scene::{Image, Material, Mesh, Node, Primitive, Scene, Texture, TextureRef, Wrap};
use linklight::stages::elements::BACK_SIDE;
use linklight::stages::world::World;

/// Means of at most ten triangles.
const TOLERANCE: Tolerance = Tolerance { absolute: 1e-6, relative: 1e-5 };

#[derive(Debug, PartialEq)]
struct Averages {
    albedo: Vec<Vec3>,
    emission: Vec<Vec3>,
    area: Vec<f32>,
}

/// The twin: textures apart, a material is its factors times the vertex colour.
fn materials(element_vertices: &[u32], geometry: &Geometry, positions: &[Vec3], materials: &[Material]) -> Averages {
    let incident = incident_triangles(geometry.vertex_count(), &geometry.triangles);
    let mut averages = Averages { albedo: Vec::new(), emission: Vec::new(), area: Vec::new() };
    for &entry in element_vertices {
        let vertex = entry & !BACK_SIDE;
        let (mut albedo, mut emission, mut area) = (Vec3::ZERO, Vec3::ZERO, 0.0);
        for &triangle in incident.row(vertex) {
            let corners = geometry.triangles[triangle as usize];
            let [a, b, c] = corners.map(|corner| positions[corner as usize]);
            let third = (b - a).cross(c - a).length() / 6.0;
            let weight = |corner: u32| if corner == vertex { 22.0 / 36.0 } else { 7.0 / 36.0 };
            let color: Vec4 = corners.iter().map(|&corner| weight(corner) * geometry.colors[corner as usize]).sum();
            let part = geometry.triangle_part[triangle as usize];
            let m = &materials[geometry.parts[part as usize].material as usize];
            let base = (m.base_color * color).truncate();
            albedo += third * if m.unlit { Vec3::ZERO } else { base * (1.0 - m.metallic) };
            emission += third * m.emission;
            area += third;
        }
        let inverse = if area > 0.0 { 1.0 / area } else { 0.0 };
        averages.albedo.push(albedo * inverse);
        averages.emission.push(emission * inverse);
        averages.area.push(area);
    }
    averages
}

fn on_device(context: &Context, scene: &Scene, geometry: &Geometry, element_vertices: &[u32]) -> Averages {
    let pose = Pose::rest(scene);
    let world = World::new(context, scene, geometry, &pose, &Environment::default(), false).unwrap();
    let incident = incident_triangles(geometry.vertex_count(), &geometry.triangles);
    let count = element_vertices.len();
    let (albedo, emission) =
        (context.buffer("test/albedo", count).unwrap(), context.buffer("test/emission", count).unwrap());
    let area = context.buffer("test/area", count).unwrap();
    let pass = Materials {
        element_vertices: &context.upload("test/vertices", element_vertices).unwrap(),
        triangles: &world.triangles,
        triangle_materials: &world.triangle_materials,
        incident_offsets: &context.upload("test/offsets", &incident.offsets).unwrap(),
        incident_triangles: &context.upload("test/incident", &incident.values).unwrap(),
        positions: &world.positions,
        attributes: &world.attributes,
        materials: &world.materials,
        albedo: &albedo,
        emission: &emission,
        area: &area,
        textures: &world.textures,
        params: MaterialsParams { element_count: count as u32 },
    };
    let mut recorder = context.recorder("test").unwrap();
    recorder.dispatch(&pass, count);
    recorder.submit().unwrap();
    Averages {
        albedo: context.download(&albedo).unwrap(),
        emission: context.download(&emission).unwrap(),
        area: context.download(&area).unwrap(),
    }
}

fn hold_averages(what: &str, got: &Averages, expected: &Averages, tolerance: Tolerance) {
    hold(&format!("{what}, albedo"), &got.albedo, &expected.albedo, tolerance);
    hold(&format!("{what}, emission"), &got.emission, &expected.emission, tolerance);
    hold(&format!("{what}, area"), &got.area, &expected.area, TOLERANCE);
}

/// `count` vertices in two parts per material, triangles between any of a part's; the last vertex has none.
pub fn jumble(count: usize, random: &mut Random) -> Scene {
    let plain = lambert(Vec3::new(0.2, 0.5, 0.8));
    let materials = vec![
        Material { metallic: 0.25, emission: Vec3::new(1.0, 2.0, 3.0), ..plain.clone() },
        Material { unlit: true, emission: Vec3::X, ..plain.clone() },
        plain,
    ];
    let mut vector = || Vec3::new(random.unit(), random.unit(), random.unit());
    let mut scene = scene(materials, vec![], &[]);
    for material in 0..3 {
        let mut primitive = Primitive { material, ..Primitive::default() };
        primitive.positions = (0..count).map(|_| vector()).collect();
        primitive.colors = (0..count).map(|_| vector().extend(1.0)).collect();
        let used = count.saturating_sub(1).max(1) as u32;
        primitive.triangles = (0..used).map(|i| [i, (i * 7 + 1) % used, (i * 3 + 2) % used]).collect();
        scene.nodes.push(Node { mesh: Some(material), ..Node::default() });
        scene.meshes.push(Mesh { primitives: vec![primitive], ..Mesh::default() });
    }
    scene
}

#[test]
fn materials_agree_with_their_twin() {
    let context = TestContext::new();
    let random = &mut Random(31);
    for count in [1, 21, 22, 64, 1009] {
        let scene = jumble(count, random);
        let geometry = Geometry::flatten(&scene, 1 << 30).unwrap();
        let vertices = geometry.vertex_count();
        let positions = geometry.local_positions.clone();
        // Every front, and the backs of some; and no element at all.
        let all: Vec<u32> = (0..vertices).chain((0..vertices).step_by(3).map(|v| v | BACK_SIDE)).collect();
        for element_vertices in [&all[..], &all[..63.min(all.len())], &all[..1], &[]] {
            let expected = materials(element_vertices, &geometry, &positions, &scene.materials);
            let got = on_device(&context, &scene, &geometry, element_vertices);
            hold_averages(&format!("{} elements", element_vertices.len()), &got, &expected, TOLERANCE);
        }
        if count > 1 {
            let expected = materials(&all, &geometry, &positions, &scene.materials);
            assert_eq!(expected.area[count - 1], 0.0, "the last vertex of a part has no triangle");
            let mut turned = scene.materials.clone();
            turned.rotate_left(1);
            let wrong = materials(&all, &geometry, &positions, &turned);
            tells_apart("exchanged materials", &wrong.albedo, &expected.albedo, TOLERANCE);
            tells_apart("exchanged emitters", &wrong.emission, &expected.emission, TOLERANCE);
        }
    }
}

/// A quad of 2 x 2 cells whose texture coordinates run over the texture once.
pub fn textured(image: Image) -> Scene {
    let texture = Some(TextureRef { texture: 0, uv_set: 0, transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] });
    let material = Material {
        base_color_texture: texture,
        emission: Vec3::new(2.0, 4.0, 6.0),
        emission_texture: texture,
        ..lambert(Vec3::new(0.5, 1.0, 0.25))
    };
    let mut scene = scene(vec![material], vec![parallelogram(Vec3::ZERO, Vec3::X, Vec3::Y, 2, 0)], &[]);
    scene.images.push(image);
    scene.textures.push(Texture {
        image: 0,
        wrap: [Wrap::Repeat; 2],
        mag_linear: true,
        min_linear: true,
        mipmapped: true,
        mip_linear: true,
    });
    scene
}

pub fn image(side: u32, srgb: bool, texel: impl Fn(u32, u32) -> [u8; 3]) -> Image {
    let rgba = (0..side * side).flat_map(|i| {
        let [r, g, b] = texel(i % side, i / side);
        [r, g, b, 255]
    });
    Image { name: "test".into(), width: side, height: side, rgba: rgba.collect(), srgb }
}

/// Black and white squares of one texel: half of the light, be the file's bytes linear or sRGB, since black and white
/// are the same in both. Without filtering an element would see one square or the border of two.
#[test]
fn a_fine_checker_counts_by_its_mean() {
    let context = TestContext::new();
    for srgb in [false, true] {
        let checker = image(128, srgb, |x, y| [if (x + y) % 2 == 0 { 255 } else { 0 }; 3]);
        let scene = textured(checker);
        let geometry = Geometry::flatten(&scene, 1 << 30).unwrap();
        let elements: Vec<u32> = (0..9).collect();
        let got = on_device(&context, &scene, &geometry, &elements);
        let expected = Averages {
            albedo: vec![Vec3::new(0.5, 1.0, 0.25) * 0.5; 9],
            emission: vec![Vec3::new(2.0, 4.0, 6.0) * 0.5; 9],
            area: got.area.clone(),
        };
        // The mean is a byte (sRGB bytes are twice as coarse there), times at most 6.
        let tolerance = Tolerance { absolute: 0.0, relative: 0.02 };
        hold_averages(if srgb { "sRGB checker" } else { "linear checker" }, &got, &expected, tolerance);
        assert!((got.area.iter().sum::<f32>() - 1.0).abs() < 1e-5, "thirds of all triangles make up the quad");
    }
}

/// Texture coordinates grow with x and with -y of the file's rows: the left column is dark, the right one bright.
#[test]
fn a_coarse_texture_is_sampled_where_the_element_is() {
    let context = TestContext::new();
    let halves = textured(image(64, false, |x, _| [if x < 32 { 51 } else { 204 }; 3]));
    let geometry = Geometry::flatten(&halves, 1 << 30).unwrap();
    let got = on_device(&context, &halves, &geometry, &[0, 1, 2, 3, 4, 5, 6, 7, 8]);
    for row in 0..3 {
        let [left, middle, right] = [0, 1, 2].map(|column| got.albedo[3 * row + column].y);
        assert!(left < 0.35 && right > 0.65 && (0.35..0.65).contains(&middle), "row {row}: {left} {middle} {right}");
    }
}
