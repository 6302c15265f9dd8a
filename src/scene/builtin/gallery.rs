//! The gallery: a hall with a skylight and eight statues, made when it is loaded, with as many triangles as asked.

use super::statues::{STATUES, Statue};
use crate::scene::shapes::{Frame, Opening, Shape, isosurface};
use crate::scene::{Camera, Light, LightKind, Material, Mesh, Node, Primitive, Projection, Scene, Transform};
use glam::{Mat3, Quat, Vec2, Vec3};
use std::ops::RangeInclusive;

/// How many triangles can be asked for.
pub const TRIANGLES: RangeInclusive<u32> = 20_000..=8_000_000;
/// Triangles where nothing is asked.
pub const DEFAULT_TRIANGLES: u32 = 100_000;
/// Bytes that loading takes per triangle at its peak, grids and the finished scene together.
pub const BYTES_PER_TRIANGLE: u64 = 160;

const HALF_LENGTH: f32 = 7.0;
const HALF_WIDTH: f32 = 4.5;
const HEIGHT: f32 = 5.0;
const PLINTH: f32 = 0.75;

/// Materials by place in the scene.
const WALL: u32 = 0;
const FLOOR: u32 = 1;
const SKYLIGHT: u32 = 2;
const PLINTHS: u32 = 3;
const WOOD: u32 = 4;
const FRAMES: u32 = 5;
const FIRST_STATUE: u32 = 6;
const FIRST_PICTURE: u32 = 14;

/// The scene with about `triangles` triangles (within a tenth), nearly all of them in the statues.
pub fn gallery(triangles: u32) -> Scene {
    let mut scene = Scene { name: "gallery".into(), materials: materials(), ..Scene::default() };
    cameras(&mut scene);
    lights(&mut scene);
    hall(&mut scene);
    let hall_triangles: usize = scene.meshes.iter().flat_map(|mesh| &mesh.primitives).map(|p| p.triangles.len()).sum();
    let share = (triangles as usize).saturating_sub(hall_triangles) / STATUES.len();
    for (k, statue) in STATUES.iter().enumerate() {
        let (at, degrees) = place(k);
        let shape = sculpt(statue, share).turned_y(degrees).moved(at + Vec3::Y * PLINTH);
        add(&mut scene, statue.name, FIRST_STATUE + k as u32, shape);
    }
    scene
}

/// Where statue `k` stands, and which way it looks.
fn place(k: usize) -> (Vec3, f32) {
    let (row, column) = (k % 2, k / 2);
    let side = if row == 0 { -1.0 } else { 1.0 };
    let at = Vec3::new(-4.8 + 3.2 * column as f32 + 0.4 * side, 0.0, 2.1 * side);
    (at, if row == 0 { -30.0 } else { 205.0 })
}

/// Meshes a statue with close to `triangles` triangles: their number goes with the inverse square of the cell.
fn sculpt(statue: &Statue, triangles: usize) -> Shape {
    let mesh = |cell: f32| isosurface(statue.low, statue.high, cell, statue.field);
    let finer = |cell: f32, found: usize| cell * (found.max(1) as f32 / triangles.max(1) as f32).sqrt();
    let coarse = 0.04;
    let estimate = finer(coarse, mesh(coarse).triangles.len());
    let shape = mesh(estimate);
    let found = shape.triangles.len();
    // Detail that the coarse mesh missed adds triangles; one correction brings the number home.
    if found.abs_diff(triangles) * 20 > triangles { mesh(finer(estimate, found)) } else { shape }
}

pub(super) fn add(scene: &mut Scene, name: &str, material: u32, shape: Shape) {
    let primitive = Primitive {
        positions: shape.positions,
        normals: shape.normals,
        triangles: shape.triangles,
        material,
        ..Primitive::default()
    };
    scene.meshes.push(Mesh { name: name.into(), primitives: vec![primitive], morph_weights: Vec::new() });
    let mesh = Some(scene.meshes.len() as u32 - 1);
    scene.nodes.push(Node { name: name.into(), mesh, ..Node::default() });
}

pub(super) fn material(name: &str, color: [f32; 3], metallic: f32, roughness: f32) -> Material {
    let base_color = Vec3::from(color).extend(1.0);
    Material { name: name.into(), base_color, metallic, roughness, ..Material::default() }
}

fn materials() -> Vec<Material> {
    let mut skylight = material("skylight", [0.0; 3], 0.0, 1.0);
    skylight.emission = Vec3::new(12.0, 13.6, 15.6);
    vec![
        material("white wall", [0.78, 0.76, 0.72], 0.0, 1.0),
        material("oak floor", [0.46, 0.33, 0.21], 0.0, 0.4),
        skylight,
        material("plinth", [0.7, 0.69, 0.66], 0.0, 0.8),
        material("bench", [0.2, 0.11, 0.06], 0.0, 0.4),
        material("picture frame", [0.05, 0.045, 0.04], 0.0, 0.5),
        material("white marble", [0.8, 0.78, 0.74], 0.0, 0.35),
        material("bronze", [0.62, 0.41, 0.22], 1.0, 0.35),
        material("terracotta", [0.62, 0.26, 0.14], 0.0, 0.8),
        material("grey stone", [0.45, 0.44, 0.43], 0.0, 0.6),
        material("celadon glaze", [0.12, 0.44, 0.4], 0.0, 0.25),
        material("dark bronze", [0.3, 0.24, 0.17], 1.0, 0.4),
        material("gilt", [0.86, 0.63, 0.24], 1.0, 0.28),
        material("sandstone", [0.68, 0.52, 0.36], 0.0, 0.9),
        material("ultramarine", [0.06, 0.12, 0.5], 0.0, 1.0),
        material("vermilion", [0.68, 0.12, 0.05], 0.0, 1.0),
        material("ochre", [0.7, 0.46, 0.1], 0.0, 1.0),
        material("viridian", [0.08, 0.36, 0.24], 0.0, 1.0),
    ]
}

/// Camera or light nodes look along their -Z.
pub(super) fn looking(from: [f32; 3], to: [f32; 3]) -> Transform {
    let back = (Vec3::from(from) - Vec3::from(to)).normalize_or(Vec3::Z);
    let up = if back.y.abs() > 0.999 { Vec3::NEG_Z } else { Vec3::Y };
    let right = up.cross(back).normalize_or(Vec3::X);
    let rotation = Quat::from_mat3(&Mat3::from_cols(right, back.cross(right), back)).normalize();
    Transform::Trs { translation: Vec3::from(from), rotation, scale: Vec3::ONE }
}

fn cameras(scene: &mut Scene) {
    for (name, eye, target, degrees) in [
        ("main", [6.7, 2.5, 0.3], [-1.6, 0.75, -0.25], 54.0f32),
        ("hall", [-6.4, 1.75, 0.55], [0.6, 1.3, -0.55], 60.0),
        ("figure", [-3.4, 1.9, 0.2], [-5.2, 1.55, -2.1], 48.0),
    ] {
        let projection = Projection::Perspective { fov_y: degrees.to_radians(), near: 0.05, far: None };
        scene.cameras.push(Camera { name: name.into(), projection });
        let camera = Some(scene.cameras.len() as u32 - 1);
        scene.nodes.push(Node { name: name.into(), transform: looking(eye, target), camera, ..Node::default() });
    }
}

fn lights(scene: &mut Scene) {
    for (name, at, target, intensity) in [
        ("spot on the figure", [-3.6, 4.7, -0.4], [-5.2, 1.4, -2.1], [170.0, 142.0, 104.0]),
        ("spot on the flame", [-0.6, 4.7, -0.4], [-2.0, 1.4, -2.1], [150.0, 125.0, 90.0]),
        ("spot on the lattice", [2.8, 4.7, -0.5], [4.4, 1.3, -2.1], [150.0, 125.0, 90.0]),
    ] {
        let [inner_angle, outer_angle] = [16.0f32, 27.0].map(f32::to_radians);
        let kind = LightKind::Spot { inner_angle, outer_angle };
        scene.lights.push(Light { name: name.into(), kind, intensity: Vec3::from(intensity), range: None });
        let light = Some(scene.lights.len() as u32 - 1);
        scene.nodes.push(Node { name: name.into(), transform: looking(at, target), light, ..Node::default() });
    }
}

fn hall(scene: &mut Scene) {
    let (x, z) = (HALF_LENGTH, HALF_WIDTH);
    let size = Vec2::new(2.0 * x, 2.0 * z);
    let slab =
        |low: [f32; 3], high: [f32; 3], bevel: f32| Shape::rounded_cuboid(Vec3::from(low), Vec3::from(high), bevel);
    let ground = Frame::new(Vec3::new(-x, 0.0, z), Vec3::X, Vec3::NEG_Z);
    add(scene, "floor", FLOOR, ground.wall(size, &[]));

    let above = Frame::new(Vec3::new(-x, HEIGHT, -z), Vec3::X, Vec3::Z);
    let skylight = Opening::rectangle(Vec2::new(2.0, 3.25), Vec2::new(12.0, 5.75));
    let well = 0.5;
    let glass = Frame { origin: above.origin + Vec3::Y * well, ..above }.pane(&skylight);
    let bars = (0..9).map(|k| {
        let at = -4.0 + k as f32;
        slab([at - 0.03, HEIGHT + 0.3, -1.25], [at + 0.03, HEIGHT + 0.38, 1.25], 0.01)
    });
    let bars = Shape::union(bars).with(slab([-5.0, HEIGHT + 0.31, -0.03], [5.0, HEIGHT + 0.37, 0.03], 0.01));
    add(scene, "skylight", SKYLIGHT, glass);
    add(scene, "skylight bars", PLINTHS, bars);

    let upright = |corner: [f32; 2], u: Vec3, width: f32| {
        Frame::new(Vec3::new(corner[0], 0.0, corner[1]), u, Vec3::Y).wall(Vec2::new(width, HEIGHT), &[])
    };
    let sides = upright([-x, -z], Vec3::X, size.x).with(upright([x, z], Vec3::NEG_X, size.x));
    let ends = upright([-x, z], Vec3::NEG_Z, size.y).with(upright([x, -z], Vec3::Z, size.y));
    let ceiling = above.wall(size, &[skylight]).with(above.reveal(&skylight, well, true));
    add(scene, "walls and ceiling", WALL, sides.with(ends).with(ceiling));
    let skirting = [
        slab([-x, 0.0, -z - 0.02], [x, 0.12, -z + 0.02], 0.008),
        slab([-x, 0.0, z - 0.02], [x, 0.12, z + 0.02], 0.008),
        slab([x - 0.02, 0.0, -z], [x + 0.02, 0.12, z], 0.008),
    ];
    add(scene, "skirting", WOOD, Shape::union(skirting));

    let plinths = STATUES.iter().enumerate().map(|(k, statue)| {
        let (at, degrees) = place(k);
        let half = [statue.low.x, statue.low.z, statue.high.x, statue.high.z].map(f32::abs);
        let [half_x, half_z] = [half[0].max(half[2]) + 0.06, half[1].max(half[3]) + 0.06];
        slab([-half_x, 0.0, -half_z], [half_x, PLINTH, half_z], 0.015).turned_y(degrees).moved(at)
    });
    add(scene, "plinths", PLINTHS, Shape::union(plinths));

    let bench = |at: f32| {
        let seat = slab([at - 0.9, 0.4, -0.25], [at + 0.9, 0.46, 0.25], 0.015);
        let legs = [at - 0.7, at + 0.6].map(|x| slab([x, 0.0, -0.2], [x + 0.1, 0.41, 0.2], 0.01));
        seat.with(Shape::union(legs))
    };
    add(scene, "benches", WOOD, bench(-1.6).with(bench(2.4)));

    for (k, name) in ["blue picture", "red picture", "yellow picture", "green picture"].into_iter().enumerate() {
        let at = -4.5 + 3.0 * k as f32;
        let half = if k % 2 == 0 { 0.9 } else { 0.65 };
        let frame = slab([at - half, 1.3, -z - 0.01], [at + half, 2.9, -z + 0.05], 0.012);
        let canvas = slab([at - half + 0.06, 1.36, -z], [at + half - 0.06, 2.84, -z + 0.056], 0.004);
        add(scene, &format!("frame of the {name}"), FRAMES, frame);
        add(scene, name, FIRST_PICTURE + k as u32, canvas);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle_count(scene: &Scene) -> usize {
        scene.meshes.iter().flat_map(|mesh| &mesh.primitives).map(|p| p.triangles.len()).sum()
    }

    #[test]
    fn the_number_of_triangles_is_what_was_asked() {
        for asked in [20_000, 110_000] {
            let found = triangle_count(&gallery(asked));
            assert!(found.abs_diff(asked as usize) * 10 <= asked as usize, "{found} triangles, {asked} asked");
        }
    }

    #[test]
    fn statues_are_closed_and_wound_outwards() {
        for statue in &STATUES {
            let shape = sculpt(statue, 12_000);
            let mut edges = std::collections::HashMap::new();
            let mut turned_over = 0;
            for &[a, b, c] in &shape.triangles {
                let [p, q, r] = [a, b, c].map(|i| shape.positions[i as usize]);
                let normals: Vec3 = [a, b, c].iter().map(|&i| shape.normals[i as usize]).sum();
                turned_over += usize::from((q - p).cross(r - p).dot(normals) <= 0.0);
                for edge in [(a, b), (b, c), (c, a)] {
                    *edges.entry(edge).or_insert(0i32) += 1;
                    *edges.entry((edge.1, edge.0)).or_insert(0i32) -= 1;
                }
            }
            assert!(edges.values().all(|n| *n == 0), "{}: every edge is walked both ways", statue.name);
            assert!(turned_over * 100 < shape.triangles.len(), "{}: {turned_over} triangles turned over", statue.name);
            let volume: f32 = shape
                .triangles
                .iter()
                .map(|t| t.map(|i| shape.positions[i as usize]))
                .map(|[p, q, r]| p.cross(q).dot(r) / 6.0)
                .sum();
            assert!(volume > 0.01, "{}: volume {volume} m3", statue.name);
            let (low, high) = shape.bounds();
            assert!(low.cmpgt(statue.low).all() && high.cmplt(statue.high).all(), "{} leaves its box", statue.name);
        }
    }

    #[test]
    fn indices_are_in_range_and_numbers_finite() {
        let scene = gallery(20_000);
        for primitive in scene.meshes.iter().flat_map(|mesh| &mesh.primitives) {
            assert_eq!(primitive.positions.len(), primitive.normals.len());
            assert!(primitive.triangles.iter().flatten().all(|i| (*i as usize) < primitive.positions.len()));
            assert!(primitive.positions.iter().chain(&primitive.normals).all(|v| v.is_finite()));
            assert!((primitive.material as usize) < scene.materials.len());
        }
        assert_eq!(scene.cameras[0].name, "main");
        assert!(scene.materials.iter().all(|m| m.base_color.max_element() <= 1.0));
    }

    #[test]
    fn two_runs_agree_to_the_bit() {
        let [a, b] = [gallery(20_000), gallery(20_000)];
        for (p, q) in a.meshes.iter().zip(&b.meshes) {
            assert_eq!(p.primitives[0].positions, q.primitives[0].positions, "{}", p.name);
            assert_eq!(p.primitives[0].triangles, q.primitives[0].triangles, "{}", p.name);
        }
    }
}
