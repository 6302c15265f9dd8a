//! A stage with two performers: a skinned dancer and a hopping blob that morphs between three shapes. One clip of four
//! seconds, with LINEAR and CUBICSPLINE channels.

use super::document::{Document, Material, Placement};
use super::figure::{self, JOINTS, LOOP};
use super::kit::{self, plan_uv, profile, rod, slab};
use glam::{Vec2, Vec3};
use linklight::scene::gltf::write::{FLOAT, Target, UNSIGNED_BYTE, UNSIGNED_SHORT, number, numbers};
use linklight::scene::shapes::{Shape, sin_cos};
use serde_json::{Value, json};

/// Keys per loop of the sampled motion; the last repeats the first.
const KEYS: usize = 33;

pub fn dancer() -> Document {
    let mut document = Document::new("dancer");
    document.camera("main", [0.5, 1.45, 4.4], [0.28, 0.92, 0.0], 40.0);
    document.camera("close", [-1.5, 1.5, 2.3], [-0.25, 1.0, 0.0], 44.0);
    document.camera("above", [2.6, 3.2, 3.4], [0.2, 0.6, -0.2], 42.0);
    stage(&mut document);
    let mut animation = Animation::default();
    performer(&mut document, &mut animation);
    blob(&mut document, &mut animation);
    document
        .animations
        .push(json!({ "name": "dance", "channels": animation.channels, "samplers": animation.samplers }));
    document
}

fn stage(document: &mut Document) {
    let boards = document.texture("boards", 128, kit::planks(10, [0.5, 0.34, 0.22], [0.68, 0.5, 0.35]));
    let boards = document.material("stage boards", Material::glossy(1.0, 1.0, 1.0, 0.35).textured(boards, 1.8));
    let velvet = document.material("velvet", Material::matte(0.5, 0.07, 0.07));
    let gold = document.material("gilt", Material::metal(0.85, 0.62, 0.25, 0.35));
    let plinth = document.material("plinth", Material::matte(0.5, 0.47, 0.42));
    let base = Shape::lathe(&[&[[2.62, -0.3], [2.62, -0.04], [2.58, 0.0]], &[[2.58, 0.0], [0.0, 0.0]]], 64);
    document.add("stage", boards, plan_uv(base));
    document.add("stage edge", gold, Shape::tube(&ring(2.62, -0.05, 48), |_| Vec2::splat(0.025), 6, false));
    let ground =
        Shape::quad([[-8.0, -0.3, 8.0], [8.0, -0.3, 8.0], [8.0, -0.3, -4.0], [-8.0, -0.3, -4.0]].map(Vec3::from));
    document.add("ground", plinth, ground);
    document.add("curtain", velvet, curtain());
    let pole: Vec<Vec3> = (0..=24).map(|i| arc(i as f32 / 24.0, 3.5)).collect();
    document.add("curtain pole", gold, Shape::tube(&pole, |_| Vec2::splat(0.03), 6, true));
    for (k, x) in [-1.9, 2.1].into_iter().enumerate() {
        let pedestal = slab([x - 0.18, x + 0.18], [0.0, 0.9], [-1.18, -0.82], 0.02);
        document.add(&format!("pedestal {}", k + 1), plinth, pedestal);
        let ball = Shape::sphere(24).scaled(Vec3::splat(0.2)).moved(Vec3::new(x, 1.1, -1.0));
        document.add(&format!("gilt ball {}", k + 1), gold, ball);
    }

    let panel = document.material("soft light", Material::light(40.0, 37.0, 32.0));
    let housing = document.material("housing", Material::matte(0.05, 0.05, 0.055));
    let quad =
        Shape::quad([[-0.9, 0.0, -0.35], [0.9, 0.0, -0.35], [0.9, 0.0, 0.35], [-0.9, 0.0, 0.35]].map(Vec3::from));
    let case = slab([-0.94, 0.94], [0.004, 0.1], [-0.39, 0.39], 0.02);
    let mesh = document.mesh("soft light", &[(panel, quad), (housing, case)]);
    document.place("soft light", mesh, Placement::at(0.0, 3.4, 0.9));
    let bar = rod([[-0.6, 3.5, 0.9], [-0.6, 5.0, 0.9]], [0.015, 0.015], 8).with(rod(
        [[0.6, 3.5, 0.9], [0.6, 5.0, 0.9]],
        [0.015, 0.015],
        8,
    ));
    document.add("hangers", housing, bar);
    document.spot_light("warm spot", [-2.6, 3.6, 2.8], [-0.3, 0.9, 0.0], [260.0, 190.0, 108.0], [12.0, 22.0]);
    document.spot_light("cool spot", [3.0, 3.4, 2.2], [0.4, 0.8, 0.0], [80.0, 140.0, 240.0], [12.0, 24.0]);
    document.point_light("footlight", [0.3, 0.05, 2.9], [7.0, 5.2, 3.2]);
}

fn ring(radius: f32, y: f32, segments: usize) -> Vec<Vec3> {
    (0..=segments)
        .map(|k| sin_cos((k % segments) as f32 / segments as f32))
        .map(|(s, c)| Vec3::new(c * radius, y, -s * radius))
        .collect()
}

/// A point of the curtain's half circle behind the stage.
fn arc(t: f32, y: f32) -> Vec3 {
    let (sin, cos) = sin_cos(0.54 - 0.58 * t);
    Vec3::new(3.0 * cos, y, -2.35 * sin)
}

/// Folds all along the half circle.
fn curtain() -> Shape {
    const COLUMNS: usize = 240;
    let mut cloth = Shape::default();
    for (row, y) in [3.5, 1.8, -0.3].into_iter().enumerate() {
        for i in 0..=COLUMNS {
            let t = i as f32 / COLUMNS as f32;
            let fold = 1.0 + (0.012 + 0.012 * row as f32) * sin_cos(t * 30.0 + 0.05 * row as f32).0;
            let at = arc(t, y);
            cloth.vertex(Vec3::new(at.x * fold, at.y, at.z * fold), Vec3::Z, Vec2::ZERO);
        }
    }
    let width = COLUMNS as u32 + 1;
    for (row, i) in (0..2).flat_map(|row| (0..COLUMNS as u32).map(move |i| (row, i))) {
        let a = row * width + i;
        cloth.quad_of([a + width, a + width + 1, a + 1, a]);
    }
    cloth.smoothed()
}

#[derive(Default)]
struct Animation {
    channels: Vec<Value>,
    samplers: Vec<Value>,
}

impl Animation {
    /// `values` holds one entry per key (LINEAR) or in-tangent, value, out-tangent per key (CUBICSPLINE).
    ///
    /// The node rests in the pose of the first key, so that a viewer without animation shows the same.
    fn channel(&mut self, document: &mut Document, node: usize, path: &str, times: &[f32], kind: &str, values: &[f32]) {
        let cubic = values.len() / times.len();
        let (components, interpolation) = match (kind, path) {
            ("SCALAR", _) => (1, if cubic > 3 { "CUBICSPLINE" } else { "LINEAR" }),
            ("VEC3", _) => (3, if cubic == 9 { "CUBICSPLINE" } else { "LINEAR" }),
            _ => (4, "LINEAR"),
        };
        let bounds = json!({ "min": [number(times[0])], "max": [number(times[times.len() - 1])] });
        let binary = &mut document.binary;
        let bytes = bytemuck::cast_slice(times);
        let input = binary.accessor("SCALAR", FLOAT, times.len(), bytes, Target::Other, &bounds);
        let rounded: Vec<f32> = values.iter().map(|v| (v * 16_384.0).round() / 16_384.0).collect();
        let (count, bytes) = (values.len() / components, bytemuck::cast_slice(&rounded));
        let output = binary.accessor(kind, FLOAT, count, bytes, Target::Other, &Value::Null);
        let width = values.len() / times.len() / if interpolation == "LINEAR" { 1 } else { 3 };
        let first = if interpolation == "LINEAR" { 0 } else { width };
        document.nodes[node][path] = numbers(&rounded[first..first + width]);
        self.channels.push(json!({ "sampler": self.samplers.len(), "target": { "node": node, "path": path } }));
        self.samplers.push(json!({ "input": input, "output": output, "interpolation": interpolation }));
    }
}

fn times(count: usize) -> Vec<f32> {
    (0..count).map(|k| LOOP * k as f32 / (count - 1) as f32).collect()
}

/// Values with Catmull-Rom tangents around the loop, as CUBICSPLINE wants them; `values` repeats its first key last.
fn with_tangents(values: &[Vec<f32>]) -> Vec<f32> {
    let n = values.len() - 1;
    let step = LOOP / n as f32;
    let mut out = Vec::new();
    for k in 0..=n {
        let (before, after) = (&values[(k + n - 1) % n], &values[(k + 1) % n]);
        let slope: Vec<f32> = before.iter().zip(after).map(|(b, a)| (a - b) / (2.0 * step)).collect();
        out.extend(&slope);
        out.extend(&values[k]);
        out.extend(&slope);
    }
    out
}

fn performer(document: &mut Document, animation: &mut Animation) {
    let body = document.material("dancer", Material::glossy(1.0, 1.0, 1.0, 0.6));
    let shape = figure::mesh();
    let mut primitive = document.primitive(body, &shape);
    let count = shape.positions.len();
    let (joints, weights): (Vec<[u8; 4]>, Vec<[u8; 4]>) = shape.positions.iter().map(|p| figure::skin(*p)).unzip();
    let colors: Vec<[u16; 4]> = shape
        .positions
        .iter()
        .map(|p| figure::color(*p).map(|c| (c * 65_535.0).round() as u16))
        .map(|[r, g, b]| [r, g, b, u16::MAX])
        .collect();
    let mut attribute = |component: u32, bytes: &[u8], is_normalized: bool| {
        let fields = if is_normalized { json!({ "normalized": true }) } else { Value::Null };
        document.binary.accessor("VEC4", component, count, bytes, Target::Vertices, &fields)
    };
    let joints = attribute(UNSIGNED_BYTE, joints.as_flattened(), false);
    let weights = attribute(UNSIGNED_BYTE, weights.as_flattened(), true);
    let colors = attribute(UNSIGNED_SHORT, bytemuck::cast_slice(&colors), true);
    primitive["attributes"]["JOINTS_0"] = json!(joints);
    primitive["attributes"]["WEIGHTS_0"] = json!(weights);
    primitive["attributes"]["COLOR_0"] = json!(colors);
    document.meshes.push(json!({ "name": "dancer", "primitives": [primitive] }));
    let mesh = document.meshes.len() - 1;

    let first = document.nodes.len();
    for (index, joint) in JOINTS.iter().enumerate() {
        let children: Vec<usize> =
            (0..JOINTS.len()).filter(|&c| JOINTS[c].parent == Some(index)).map(|c| first + c).collect();
        let mut node = json!({ "name": joint.name, "translation": numbers(&joint.offset().to_array()) });
        if !children.is_empty() {
            node["children"] = json!(children);
        }
        document.nodes.push(node);
    }
    let inverse_bind: Vec<[f32; 16]> = JOINTS
        .iter()
        .map(|joint| {
            let [x, y, z] = (-joint.head).to_array();
            [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, x, y, z, 1.0]
        })
        .collect();
    let matrices = {
        let bytes = bytemuck::cast_slice(&inverse_bind);
        document.binary.accessor("MAT4", FLOAT, JOINTS.len(), bytes, Target::Other, &Value::Null)
    };
    let list: Vec<usize> = (first..first + JOINTS.len()).collect();
    document
        .skins
        .push(json!({ "name": "dancer", "joints": list, "inverseBindMatrices": matrices, "skeleton": first }));
    let root = json!({ "name": "dancer", "translation": [-0.35, 0, 0], "children": [first] });
    document.nodes.push(root);
    document.nodes.push(json!({ "name": "dancer skin", "mesh": mesh, "skin": document.skins.len() - 1 }));

    let keys = times(KEYS);
    let hips: Vec<Vec<f32>> = keys.iter().map(|t| figure::hips_at(t % LOOP).to_array().to_vec()).collect();
    animation.channel(document, first, "translation", &keys, "VEC3", &with_tangents(&hips));
    for (index, joint) in JOINTS.iter().enumerate() {
        let turns: Vec<[f32; 4]> = keys.iter().map(|t| joint.rotation(t % LOOP)).collect();
        animation.channel(document, first + index, "rotation", &keys, "VEC4", turns.as_flattened());
    }
}

/// Height over the floor, radius, and slant of a blob that is squashed, stretched or bent.
type Bend = fn(Vec3) -> Vec3;

const BENDS: [(&str, Bend); 3] = [
    ("squash", |p| Vec3::new(p.x * 1.3, p.y * 0.6, p.z * 1.3)),
    ("stretch", |p| Vec3::new(p.x * 0.8, p.y * 1.42, p.z * 0.8)),
    ("lean", |p| Vec3::new(p.x + 0.85 * p.y * p.y, p.y - 0.25 * p.y * p.x, p.z)),
];

fn blob(document: &mut Document, animation: &mut Animation) {
    let outline = profile(
        [[0.0, 0.0], [0.2, 0.008], [0.315, 0.07], [0.32, 0.2], [0.25, 0.36], [0.2, 0.47], [0.13, 0.57], [0.0, 0.61]],
        3,
    );
    let skin = Shape::lathe(&[&outline], 28).smoothed();
    let eyes = [-0.085, 0.085].map(|x| Shape::sphere(12).scaled(Vec3::splat(0.058)).moved(Vec3::new(x, 0.43, 0.165)));
    let pupils = [-0.088, 0.088].map(|x| Shape::sphere(8).scaled(Vec3::splat(0.028)).moved(Vec3::new(x, 0.436, 0.204)));
    let green = document.material("blob", Material::glossy(0.3, 0.6, 0.16, 0.3));
    let white = document.material("eyes", Material::glossy(0.8, 0.8, 0.78, 0.2));
    let black = document.material("pupils", Material::glossy(0.03, 0.03, 0.03, 0.15));
    let parts = [(green, skin), (white, Shape::union(eyes)), (black, Shape::union(pupils))];
    let primitives: Vec<Value> = parts
        .iter()
        .map(|(material, shape)| {
            let mut primitive = document.primitive(*material, shape);
            let targets: Vec<Value> = BENDS.iter().map(|(_, bend)| target(document, shape, *bend)).collect();
            primitive["targets"] = json!(targets);
            primitive
        })
        .collect();
    let names: Vec<&str> = BENDS.iter().map(|(name, _)| *name).collect();
    document.meshes.push(
        json!({ "name": "blob", "primitives": primitives, "weights": [0, 0, 0], "extras": { "targetNames": names } }),
    );
    let node = document.nodes.len();
    document.nodes.push(json!({ "name": "blob", "mesh": document.meshes.len() - 1 }));

    // Two hops a loop: crouch, leap, land.
    let keys = times(17);
    let hop = |t: f32| (t / LOOP * 2.0).fract();
    let height: Vec<Vec<f32>> = keys
        .iter()
        .map(|&t| {
            let air = ((hop(t) - 0.25) / 0.5).clamp(0.0, 1.0);
            vec![0.85 + 0.12 * sin_cos(t / LOOP).0, 1.4 * air * (1.0 - air), 0.25]
        })
        .collect();
    animation.channel(document, node, "translation", &keys, "VEC3", &with_tangents(&height));
    let weights: Vec<Vec<f32>> = keys
        .iter()
        .map(|&t| {
            let wave = sin_cos(hop(t) + 0.25).0;
            vec![0.9 * wave.max(0.0), 0.8 * (-wave).max(0.0), 0.5 * sin_cos(t / LOOP + 0.1).0]
        })
        .collect();
    animation.channel(document, node, "weights", &keys, "SCALAR", &with_tangents(&weights));
    let turns: Vec<[f32; 4]> = keys
        .iter()
        .map(|&t| {
            let (sin, cos) = sin_cos((-14.0 + 20.0 * sin_cos(t / LOOP).0) / 720.0);
            [0.0, sin, 0.0, cos]
        })
        .collect();
    animation.channel(document, node, "rotation", &keys, "VEC4", turns.as_flattened());
}

/// Displacements of positions and normals that `bend` makes.
fn target(document: &mut Document, shape: &Shape, bend: Bend) -> Value {
    let mut bent = shape.clone();
    bent.positions.iter_mut().for_each(|p| *p = bend(*p));
    let bent = bent.smoothed();
    let difference = |a: &[Vec3], b: &[Vec3]| -> Vec<Vec3> { a.iter().zip(b).map(|(a, b)| *a - *b).collect() };
    let positions = document.binary.positions(&difference(&bent.positions, &shape.positions));
    let normals = document.binary.floats("VEC3", &difference(&bent.normals, &shape.normals));
    json!({ "POSITION": positions, "NORMAL": normals })
}
