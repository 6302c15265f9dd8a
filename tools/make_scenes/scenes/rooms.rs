//! Closed rooms for exact answers: the furnace, and two rooms with a closed door between them.

use super::document::{Document, Material};
use glam::{Vec2, Vec3};
use linklight::scene::shapes::{Frame, Opening, Shape};

/// A closed room in which every surface has albedo 0.5 and emits 1 W m^-2 sr^-1: after k bounces the radiance is
/// 2 - 2^-k everywhere.
pub fn furnace() -> Document {
    let mut document = Document::new("furnace");
    let wall = Material { color: [0.5; 3], ..Material::light(1.0, 1.0, 1.0) };
    let wall = document.material("albedo 0.5, radiance 1", wall);
    document.camera("main", [1.25, 1.5, 1.75], [-1.0, 1.0, -2.0], 55.0);
    document.add("room", wall, Shape::room(Vec3::new(-2.0, 0.0, -2.5), Vec3::new(2.0, 3.0, 2.5)));
    document
}

// Two rooms side by side along X. All coordinates are multiples of 1/64 m, so that sums of them are exact and edges
// that meet are equal to the bit.
const HALF_LENGTH: f32 = 4.25;
const HALF_DEPTH: f32 = 2.0;
const HEIGHT: f32 = 2.75;
const HALF_WALL: f32 = 0.125;
const HALF_DOOR: f32 = 0.03125;
const DOOR: [Vec2; 2] = [Vec2::new(1.5, 0.0), Vec2::new(2.5, 2.125)];

/// Two rooms that share a thick wall. The closed door fills the doorway: each side of it closes its own room along the
/// very edges of the frame, and reaches on into the wall. Light in the left room only; the right one is exactly dark.
pub fn two_rooms() -> Document {
    let mut document = Document::new("two-rooms");
    let plaster = document.material("plaster", Material::matte(0.74, 0.72, 0.68));
    let ochre = document.material("ochre wall", Material::matte(0.72, 0.47, 0.18));
    let blue = document.material("blue wall", Material::matte(0.2, 0.36, 0.55));
    let floor = document.material("floor", Material::matte(0.42, 0.31, 0.22));
    let wood = document.material("door", Material::matte(0.46, 0.2, 0.1));
    let brass = document.material("handle", Material::metal(0.82, 0.65, 0.32, 0.35));
    let stone = document.material("stone", Material::matte(0.62, 0.62, 0.6));
    let lamp = document.material("lamp", Material::light(40.0, 36.0, 30.0));
    document.camera("main", [-3.875, 1.625, 1.75], [-0.5, 1.125, -0.5], 58.0);
    document.camera("dark", [3.875, 1.625, -1.75], [0.5, 1.125, 0.5], 58.0);

    // Everything is built for the left room and turned half round for the right one; the door handle is on both sides.
    for (turn, side, accent) in [(0.0, "lit", ochre), (180.0, "dark", blue)] {
        let mut add = |name: &str, material: usize, shape: Shape| {
            document.add(&format!("{side} {name}"), material, shape.turned_y(turn));
        };
        let [far_left, right] = [-HALF_LENGTH, -HALF_WALL];
        add(
            "floor",
            floor,
            Frame::new(Vec3::new(far_left, 0.0, HALF_DEPTH), Vec3::X, Vec3::NEG_Z)
                .wall(Vec2::new(right - far_left, 2.0 * HALF_DEPTH), &[]),
        );
        let up = |origin: [f32; 3], u: Vec3, width: f32| {
            Frame::new(Vec3::from(origin), u, Vec3::Y).wall(Vec2::new(width, HEIGHT), &[])
        };
        add("end wall", accent, up([far_left, 0.0, HALF_DEPTH], Vec3::NEG_Z, 2.0 * HALF_DEPTH));
        let length = right - far_left;
        add(
            "side walls",
            plaster,
            up([far_left, 0.0, -HALF_DEPTH], Vec3::X, length).with(up([right, 0.0, HALF_DEPTH], Vec3::NEG_X, length)),
        );
        let hole = Opening::rectangle(DOOR[0], DOOR[1]);
        let shared = Frame::new(Vec3::new(right, 0.0, -HALF_DEPTH), Vec3::Z, Vec3::Y);
        add("door wall", plaster, shared.wall(Vec2::new(2.0 * HALF_DEPTH, HEIGHT), &[hole]));
        add("doorway", plaster, shared.reveal(&hole, HALF_WALL - HALF_DOOR, true));
        add("door", wood, door_side());
        add("door handle", brass, handle());
        add("ceiling", plaster, ceiling(far_left, right));
        let pedestal = Shape::rounded_cuboid(Vec3::new(-1.75, 0.0, -1.5), Vec3::new(-1.0, 0.875, -0.75), 0.02);
        let ball = Shape::sphere(32).scaled(Vec3::splat(0.3125)).moved(Vec3::new(-1.375, 1.1875, -1.125));
        add("pedestal", stone, pedestal);
        add("ball", accent, ball);
        let bench = Shape::rounded_cuboid(Vec3::new(-3.5, 0.375, -1.875), Vec3::new(-2.0, 0.4375, -1.4375), 0.012);
        let legs =
            [-3.375, -2.1875].map(|x| Shape::cuboid(Vec3::new(x, 0.0, -1.8125), Vec3::new(x + 0.0625, 0.375, -1.5)));
        add("bench", wood, bench.with(Shape::union(legs)));
    }
    let [x, z] = LAMP_CENTRE;
    let h = LAMP_HALF;
    let corners =
        [[x - h, z - h], [x + h, z - h], [x + h, z + h], [x - h, z + h]].map(|[x, z]| Vec3::new(x, HEIGHT, z));
    document.add("lamp", lamp, Shape::quad(corners));
    document.add("lamp cover of the dark room", plaster, Shape::quad(corners).turned_y(180.0));
    document
}

const LAMP_CENTRE: [f32; 2] = [-2.25, 0.25];
const LAMP_HALF: f32 = 0.375;

/// The ceiling with a hole for the lamp.
fn ceiling(left: f32, right: f32) -> Shape {
    let frame = Frame::new(Vec3::new(left, HEIGHT, -HALF_DEPTH), Vec3::X, Vec3::Z);
    let centre = Vec2::new(LAMP_CENTRE[0] - left, LAMP_CENTRE[1] + HALF_DEPTH);
    let hole = Opening::rectangle(centre - LAMP_HALF, centre + LAMP_HALF);
    frame.wall(Vec2::new(right - left, 2.0 * HALF_DEPTH), &[hole])
}

/// One face of the door, seen from its room: it fills the doorway and reaches an eighth of a metre into the wall above
/// and beside it, and below the floor.
fn door_side() -> Shape {
    let overlap = Vec2::splat(0.125);
    let corner = DOOR[0] - overlap;
    let frame = Frame::new(Vec3::new(-HALF_DOOR, corner.y, corner.x - HALF_DEPTH), Vec3::Z, Vec3::Y);
    let size = DOOR[1] - DOOR[0] + 2.0 * overlap;
    let hole = Opening::rectangle(overlap, size - overlap);
    frame.wall(size, &[hole]).with(frame.pane(&hole))
}

fn handle() -> Shape {
    let z = DOOR[1].x - HALF_DEPTH - 0.09375;
    let stem = [[-HALF_DOOR, 1.0, z], [-0.08, 1.0, z]].map(Vec3::from);
    let grip = [[-0.08, 1.0, z + 0.012], [-0.08, 1.0, z - 0.13]].map(Vec3::from);
    let radius = |r: f32| move |_: f32| Vec2::splat(r);
    Shape::tube(&stem, radius(0.01), 12, false).with(Shape::tube(&grip, radius(0.012), 12, true))
}
