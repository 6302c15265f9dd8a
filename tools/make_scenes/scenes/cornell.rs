//! The Cornell box as measured by the Cornell University Program of Computer Graphics, at one hundredth: the published
//! coordinates are 552.8 wide, ours are 5.528 m. Reflectances and the colour of the lamp are RGB approximations of the
//! measured spectra; the lamp's strength, which the data leave open, suits the default exposure. The lamp fills its hole in the ceiling, so that no two surfaces coincide.

use super::document::{Document, Material};
use glam::Vec3;
use linklight::scene::shapes::Shape;

const METRES: f32 = 0.01;

/// x and z of the lamp's edges and its height.
const LAMP: ([f32; 2], [f32; 2], f32) = ([213.0, 343.0], [227.0, 332.0], 548.8);

type Corners = [[f32; 3]; 4];

const FLOOR: Corners = [[552.8, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 559.2], [549.6, 0.0, 559.2]];
const BACK: Corners = [[549.6, 0.0, 559.2], [0.0, 0.0, 559.2], [0.0, 548.8, 559.2], [556.0, 548.8, 559.2]];
const RIGHT: Corners = [[0.0, 0.0, 559.2], [0.0, 0.0, 0.0], [0.0, 548.8, 0.0], [0.0, 548.8, 559.2]];
const LEFT: Corners = [[552.8, 0.0, 0.0], [549.6, 0.0, 559.2], [556.0, 548.8, 559.2], [556.0, 548.8, 0.0]];

/// Tops of the boxes as (x, z), going round, and their heights.
const SHORT_BOX: ([[f32; 2]; 4], f32) = ([[130.0, 65.0], [82.0, 225.0], [240.0, 272.0], [290.0, 114.0]], 165.0);
const TALL_BOX: ([[f32; 2]; 4], f32) = ([[423.0, 247.0], [265.0, 296.0], [314.0, 456.0], [472.0, 406.0]], 330.0);

pub fn with_boxes() -> Document {
    let (mut document, white) = room("cornell-box");
    document.add("short box", white, standing_box(SHORT_BOX));
    document.add("tall box", white, standing_box(TALL_BOX));
    document
}

pub fn empty() -> Document {
    room("cornell-empty").0
}

fn room(name: &str) -> (Document, usize) {
    let mut document = Document::new(name);
    let white = document.material("white", Material::matte(0.725, 0.71, 0.68));
    let red = document.material("red", Material::matte(0.63, 0.065, 0.05));
    let green = document.material("green", Material::matte(0.14, 0.45, 0.091));
    let lamp = Material { color: [0.78; 3], ..Material::light(46.0, 34.75, 17.0) };
    let lamp = document.material("lamp", lamp);
    document.camera("main", [2.78, 2.73, -8.0], [2.78, 2.73, 0.0], 39.3077);
    document.add("floor", white, quad(FLOOR));
    document.add("back wall", white, quad(BACK));
    document.add("green wall", green, quad(RIGHT));
    document.add("red wall", red, quad(LEFT));
    document.add("ceiling", white, ceiling());
    let ([left, right], [near, far], y) = LAMP;
    document.add("lamp", lamp, quad([[right, y, near], [right, y, far], [left, y, far], [left, y, near]]));
    (document, white)
}

fn quad(corners: Corners) -> Shape {
    Shape::quad(corners.map(|p| Vec3::from(p) * METRES))
}

/// The ceiling around the lamp: a grid of three by three without its middle.
fn ceiling() -> Shape {
    let ([left, right], [near, far], y) = LAMP;
    let (x, z) = ([0.0, left, right, 556.0], [0.0, near, far, 559.2]);
    let mut shape = Shape::default();
    for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))).filter(|cell| *cell != (1, 1)) {
        shape.append(quad([[x[i + 1], y, z[j]], [x[i + 1], y, z[j + 1]], [x[i], y, z[j + 1]], [x[i], y, z[j]]]));
    }
    shape.uv.fill(glam::Vec2::ZERO);
    shape.welded()
}

/// Top and sides of a box that stands on the floor.
fn standing_box((top, height): ([[f32; 2]; 4], f32)) -> Shape {
    let at = |k: usize, y: f32| [top[k % 4][0], y, top[k % 4][1]];
    let sides = (0..4).map(|k| quad([at(k, height), at(k, 0.0), at(k + 1, 0.0), at(k + 1, height)]));
    quad([at(0, height), at(1, height), at(2, height), at(3, height)]).with(Shape::union(sides))
}
