//! A maze lit only indirectly, after the test of Dachsbacher et al. 2007 (their Fig. 12): sunlight falls through a slot
//! in the ceiling behind the tallest partition and hits the side of it that the viewer cannot see. Everything in the
//! main view is lit by one bounce or more.

use super::document::{Document, Material};
use super::kit::slab;
use glam::{Vec2, Vec3};
use linklight::scene::shapes::{Frame, Opening, Shape};

const HALF_WIDTH: f32 = 5.0;
const HALF_LENGTH: f32 = 6.0;
const HEIGHT: f32 = 4.0;

/// Partitions as centre lines from (x, z) to (x, z) along one axis, with height; half their thickness stands out at
/// either end. Those at a wall end on its surface: beyond it the sun shines.
struct Partition([f32; 2], [f32; 2], f32);

const WHITE: [Partition; 8] = [
    Partition([-3.5, -4.0], [3.5, -4.0], 2.25),
    Partition([-3.25, -2.25], [-0.75, -2.25], 1.6),
    Partition([0.75, -2.25], [3.25, -2.25], 1.6),
    Partition([-4.90625, 0.25], [-3.25, 0.25], 1.4),
    Partition([-1.75, -0.75], [1.25, -0.75], 1.4),
    Partition([3.25, 0.5], [4.90625, 0.5], 1.4),
    Partition([-0.25, 0.75], [-0.25, 2.9], 1.15),
    Partition([-3.25, 3.0], [-0.16, 3.0], 1.2),
];
const RED: [Partition; 2] =
    [Partition([-3.25, -2.25], [-3.25, -0.5], 1.55), Partition([1.25, -0.75], [1.25, 1.5], 1.35)];
const BLUE: [Partition; 2] =
    [Partition([3.25, -2.25], [3.25, 0.5], 1.55), Partition([-1.75, -0.75], [-1.75, 1.75], 1.35)];
const YELLOW: [Partition; 1] = [Partition([1.25, 2.75], [3.5, 2.75], 1.15)];

pub fn maze() -> Document {
    let mut document = Document::new("maze");
    document.camera("main", [0.0, 3.7, 5.9], [0.0, 0.55, -0.9], 62.0);
    document.camera("corridor", [-4.4, 1.75, 5.5], [0.6, 0.6, -0.8], 60.0);
    document.camera("light court", [-4.6, 2.4, -5.2], [1.0, 0.8, -4.3], 65.0);
    // The sun crosses the slot and meets the far side of the tall partition between floor and two metres.
    document.sun("sun", [0.0, -1.0, 0.34], [400.0, 376.0, 328.0]);

    let plaster = document.material("plaster", Material::matte(0.76, 0.74, 0.7));
    let floor = document.material("floor", Material::matte(0.5, 0.47, 0.43));
    // Coloured partitions are thinner and lower than the white ones they run into, so that no faces coincide.
    for (name, color, thickness, partitions) in [
        ("white partitions", [0.8, 0.78, 0.74], 0.1875, &WHITE[..]),
        ("red partitions", [0.7, 0.16, 0.08], 0.15, &RED[..]),
        ("blue partitions", [0.1, 0.3, 0.55], 0.15, &BLUE[..]),
        ("yellow partition", [0.75, 0.55, 0.1], 0.15, &YELLOW[..]),
    ] {
        let material = document.material(name, Material::matte(color[0], color[1], color[2]));
        document.add(name, material, Shape::union(partitions.iter().map(|p| p.shape(thickness))));
    }
    let stone = document.material("stone", Material::matte(0.62, 0.6, 0.58));
    let ball = Shape::sphere(40).scaled(Vec3::splat(0.45)).moved(Vec3::new(2.4, 0.45, 1.4));
    let small_ball = Shape::sphere(32).scaled(Vec3::splat(0.3)).moved(Vec3::new(-0.9, 0.3, 0.9));
    let column = Shape::cylinder(0.3, 0.0, 1.2, 32).moved(Vec3::new(-2.6, 0.0, 1.0));
    document.add("stones", stone, ball.with(small_ball).with(column));

    let size = Vec2::new(2.0 * HALF_WIDTH, 2.0 * HALF_LENGTH);
    let [x, z] = [HALF_WIDTH, HALF_LENGTH];
    document.add("floor", floor, Frame::new(Vec3::new(-x, 0.0, z), Vec3::X, Vec3::NEG_Z).wall(size, &[]));
    let slot = Opening::rectangle(Vec2::new(1.5, 0.5), Vec2::new(8.5, 1.25));
    let ceiling = Frame::new(Vec3::new(-x, HEIGHT, -z), Vec3::X, Vec3::Z);
    document.add("ceiling", plaster, ceiling.wall(size, &[slot]).with(ceiling.reveal(&slot, 0.25, true)));
    let wall = |origin: [f32; 2], u: Vec3, width: f32| {
        Frame::new(Vec3::new(origin[0], 0.0, origin[1]), u, Vec3::Y).wall(Vec2::new(width, HEIGHT), &[])
    };
    let sides = wall([-x, z], Vec3::NEG_Z, size.y).with(wall([x, -z], Vec3::Z, size.y));
    document.add("walls", plaster, sides.with(wall([-x, -z], Vec3::X, size.x)).with(wall([x, z], Vec3::NEG_X, size.x)));
    document
}

impl Partition {
    fn shape(&self, thickness: f32) -> Shape {
        let Self(from, to, height) = *self;
        let half = thickness * 0.5;
        slab([from[0] - half, to[0] + half], [0.0, height], [from[1] - half, to[1] + half], 0.015)
    }
}
