//! Two unit squares, for form factors. The emitter is black and sends radiosity 1 (radiance 1/pi); the receiver has
//! albedo 1, so that its mean radiosity is the form factor: 0.199825 for parallel squares at distance 1, 0.200044 for
//! perpendicular squares sharing an edge. Both are one-sided and face each other. The orthographic camera sees the
//! receiver and nothing else: pi times the mean of its picture is the form factor.

use super::document::{Document, Material};
use glam::Vec3;
use linklight::scene::shapes::Shape;

pub fn parallel() -> Document {
    let mut document = with_receiver("parallel-plates", [0.5, 0.5, 0.5], [1.9, 0.75, 2.2]);
    let emitter = document.material("emitter, radiosity 1", emitter());
    let down = [[0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0]].map(Vec3::from);
    document.add("emitter, y = 1, facing down", emitter, Shape::quad(down));
    document
}

pub fn perpendicular() -> Document {
    let mut document = with_receiver("perpendicular-plates", [0.5, 2.0, 0.5], [1.9, 1.3, 2.2]);
    let emitter = document.material("emitter, radiosity 1", emitter());
    let right = [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 1.0]].map(Vec3::from);
    document.add("emitter, x = 0, facing +x", emitter, Shape::quad(right));
    document
}

fn emitter() -> Material {
    Material::light(1.0, 1.0, 1.0).scaled_emission(std::f32::consts::FRAC_1_PI)
}

fn with_receiver(name: &str, above: [f32; 3], eye: [f32; 3]) -> Document {
    let mut document = Document::new(name);
    document.camera("main", eye, [0.5, 0.42, 0.5], 35.0);
    document.orthographic("receiver", above, [0.5, 0.0, 0.5], 0.5);
    let receiver = document.material("receiver, albedo 1", Material::matte(1.0, 1.0, 1.0));
    let up = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]].map(Vec3::from);
    document.add("receiver, y = 0, facing up", receiver, Shape::quad(up));
    document
}
