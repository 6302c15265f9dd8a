//! Copies of built-in scenes with fewer vertices: as many objects, lights, joints and targets, but frames cost little, so
//! that long work can go through many of them.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::Vec3;
use serde_json::{Value, json};

use crate::scene::builtin::{self, Source};
use crate::scene::{Scene, load_bytes};

/// A .glb of the program's own making (no strides, nothing sparse) with one vertex for each cube of `cell` metres of its
/// mesh, and for each of six directions of normals; triangles without area are dropped.
fn coarse(glb: &[u8], cell: f32) -> Vec<u8> {
    let word = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().unwrap()) as usize;
    let binary_at = 20 + word(12);
    let mut file = File {
        json: serde_json::from_slice(&glb[20..binary_at]).unwrap(),
        binary: glb[binary_at + 8..binary_at + 8 + word(binary_at)].to_vec(),
    };
    let mut meshes = file.json["meshes"].take();
    for primitive in meshes.as_array_mut().unwrap().iter_mut().flat_map(|m| m["primitives"].as_array_mut().unwrap()) {
        file.coarsen(primitive, cell);
    }
    file.json["meshes"] = meshes;
    file.glb()
}

/// Where a coarse copy of a built-in scene was written, in `folder`.
pub fn coarse_file(folder: &Path, name: &str, cell: f32) -> PathBuf {
    let Ok(Source::File(glb)) = builtin::resolve(name) else { panic!("{name} is not kept as a file") };
    let file = folder.join(format!("{name}.glb"));
    std::fs::write(&file, coarse(glb, cell)).unwrap();
    file
}

struct File {
    json: Value,
    binary: Vec<u8>,
}

impl File {
    fn coarsen(&mut self, primitive: &mut Value, cell: f32) {
        let floats = |bytes: &[u8]| bytemuck::pod_collect_to_vec::<u8, [f32; 3]>(bytes);
        let positions = floats(self.bytes(&primitive["attributes"]["POSITION"]).0);
        let normals = floats(self.bytes(&primitive["attributes"]["NORMAL"]).0);
        let (bytes, size) = self.bytes(&primitive["indices"]);
        let corners: Vec<usize> = bytes
            .chunks_exact(size)
            .map(|b| b.iter().rev().fold(0, |number, byte| number << 8 | usize::from(*byte)))
            .collect();
        let (kept, triangles) = (0..)
            .map(|halvings| collapse(&positions, &normals, &corners, cell / f32::powi(2.0, halvings)))
            .find(|(_, triangles)| !triangles.is_empty())
            .unwrap();
        for accessor in primitive["attributes"].as_object_mut().unwrap().values_mut() {
            *accessor = self.pick(accessor, &kept);
        }
        let targets = primitive.get_mut("targets").and_then(Value::as_array_mut);
        for accessor in targets.into_iter().flatten().flat_map(|t| t.as_object_mut().unwrap().values_mut()) {
            *accessor = self.pick(accessor, &kept);
        }
        let count = 3 * triangles.len();
        let accessor = json!({ "componentType": 5125, "count": count, "type": "SCALAR" });
        primitive["indices"] = self.accessor(accessor, bytemuck::cast_slice(&triangles));
    }

    /// The bytes of an accessor, and how many an entry has.
    fn bytes(&self, index: &Value) -> (&[u8], usize) {
        let accessor = &self.json["accessors"][index.as_u64().unwrap() as usize];
        let view = &self.json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let number = |value: &Value| value.as_u64().unwrap_or(0) as usize;
        let start = number(&view["byteOffset"]) + number(&accessor["byteOffset"]);
        let components = match accessor["type"].as_str().unwrap() {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            _ => 4,
        };
        let size = components * [1, 1, 2, 2, 4, 4, 4][number(&accessor["componentType"]) - 5120];
        (&self.binary[start..start + size * number(&accessor["count"])], size)
    }

    /// An accessor with some of the entries of another.
    fn pick(&mut self, index: &Value, kept: &[usize]) -> Value {
        let (bytes, size) = self.bytes(index);
        let picked: Vec<u8> = kept.iter().flat_map(|k| &bytes[k * size..(k + 1) * size]).copied().collect();
        let mut accessor = self.json["accessors"][index.as_u64().unwrap() as usize].clone();
        accessor["count"] = json!(kept.len());
        if accessor.get("min").is_some() {
            let entries: Vec<[f32; 3]> = bytemuck::pod_collect_to_vec(&picked);
            let fold = |pick: fn(f32, f32) -> f32| {
                entries.iter().copied().reduce(|a, b| [0, 1, 2].map(|axis| pick(a[axis], b[axis])))
            };
            (accessor["min"], accessor["max"]) = (json!(fold(f32::min)), json!(fold(f32::max)));
        }
        self.accessor(accessor, &picked)
    }

    fn accessor(&mut self, mut accessor: Value, bytes: &[u8]) -> Value {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let view = json!({ "buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len() });
        self.binary.extend_from_slice(bytes);
        let views = self.json["bufferViews"].as_array_mut().unwrap();
        views.push(view);
        accessor["bufferView"] = json!(views.len() - 1);
        accessor.as_object_mut().unwrap().remove("byteOffset");
        let accessors = self.json["accessors"].as_array_mut().unwrap();
        accessors.push(accessor);
        json!(accessors.len() - 1)
    }

    fn glb(mut self) -> Vec<u8> {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        self.json["buffers"] = json!([{ "byteLength": self.binary.len() }]);
        let mut text = self.json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let word = |number: usize| (number as u32).to_le_bytes();
        let total = 28 + text.len() + self.binary.len();
        let head = [*b"glTF", word(2), word(total), word(text.len()), *b"JSON"];
        [head.as_flattened(), &text, &word(self.binary.len()), b"BIN\0", &self.binary].concat()
    }
}

/// Which vertices stay, and the triangles between them.
fn collapse(positions: &[[f32; 3]], normals: &[[f32; 3]], corners: &[usize], cell: f32) -> (Vec<usize>, Vec<[u32; 3]>) {
    let (mut kept, mut by_cell) = (Vec::new(), HashMap::new());
    let place = |vertex: usize| {
        let normal = normals[vertex];
        let axis = (0..3).max_by(|a, b| normal[*a].abs().total_cmp(&normal[*b].abs()));
        let side = axis.map(|axis| (axis, normal[axis] > 0.0));
        (positions[vertex].map(|x| (x / cell).floor() as i64), side)
    };
    let mut stands_for = |vertex: usize| {
        *by_cell.entry(place(vertex)).or_insert_with(|| {
            kept.push(vertex);
            kept.len() as u32 - 1
        })
    };
    let triangles: Vec<[u32; 3]> =
        corners.chunks_exact(3).map(|t| [stands_for(t[0]), stands_for(t[1]), stands_for(t[2])]).collect();
    let at = |corner: u32| Vec3::from(positions[kept[corner as usize]]);
    let has_area = |[a, b, c]: &[u32; 3]| (at(*b) - at(*a)).cross(at(*c) - at(*a)).length() > 1e-9;
    let triangles = triangles.into_iter().filter(has_area).collect();
    (kept, triangles)
}

#[test]
fn coarse_copies_keep_what_moves_and_shines() {
    for name in ["dancer", "tea-room"] {
        let Ok(Source::File(glb)) = builtin::resolve(name) else { panic!("{name} is a file") };
        let [whole, small] = [glb.to_vec(), coarse(glb, 0.25)].map(|glb| load_bytes(name, &glb).unwrap());
        let counts = |s: &Scene| {
            let primitives: Vec<usize> = s.meshes.iter().map(|mesh| mesh.primitives.len()).collect();
            ([s.nodes.len(), s.materials.len(), s.skins.len(), s.clips.len(), s.lights.len()], primitives)
        };
        assert_eq!(small.notes, [""; 0], "{name}");
        assert_eq!(counts(&small), counts(&whole), "{name}");
        let vertices =
            |s: &Scene| s.meshes.iter().flat_map(|m| &m.primitives).map(|p| p.positions.len()).sum::<usize>();
        println!("{name}: {} of {} vertices", vertices(&small), vertices(&whole));
        assert!(vertices(&small) * 4 < vertices(&whole), "{name}");
    }
}
