//! The built-in scenes: the committed files are what their source makes, and every file is sound.

#[path = "../tools/make_scenes/scenes/mod.rs"]
mod scenes;

use glam::Vec3;
use linklight::scene::builtin::{self, Source};
use serde_json::Value;
use std::path::Path;

/// A .glb taken apart without the program's own loader.
struct Glb {
    json: Value,
    binary: Vec<u8>,
}

impl Glb {
    fn parse(bytes: &[u8]) -> Self {
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!(&bytes[..4], b"glTF");
        assert_eq!((word(4), word(8)), (2, bytes.len()), "version and length");
        let text = word(12);
        let binary = 20 + text;
        assert_eq!((word(16), word(binary + 4)), (0x4E4F_534A, 0x004E_4942), "chunk kinds");
        assert_eq!(binary + 8 + word(binary), bytes.len(), "the chunks fill the file");
        let json = serde_json::from_slice(&bytes[20..binary]).unwrap();
        Self { json, binary: bytes[binary + 8..].to_vec() }
    }

    /// The numbers of an accessor, component by component.
    fn accessor(&self, index: &Value) -> Vec<f64> {
        let accessor = &self.json["accessors"][index.as_u64().unwrap() as usize];
        let view = &self.json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let [offset, length] = ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap() as usize);
        let bytes = &self.binary[offset..offset + length];
        let components = match accessor["type"].as_str().unwrap() {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            "MAT4" => 16,
            other => panic!("accessor type {other}"),
        };
        let values: Vec<f64> = match accessor["componentType"].as_u64().unwrap() {
            5121 => bytes.iter().map(|b| f64::from(*b)).collect(),
            5123 => bytes.chunks_exact(2).map(|b| f64::from(u16::from_le_bytes(b.try_into().unwrap()))).collect(),
            5125 => bytes.chunks_exact(4).map(|b| f64::from(u32::from_le_bytes(b.try_into().unwrap()))).collect(),
            5126 => bytes.chunks_exact(4).map(|b| f64::from(f32::from_le_bytes(b.try_into().unwrap()))).collect(),
            other => panic!("component type {other}"),
        };
        assert_eq!(values.len(), components * accessor["count"].as_u64().unwrap() as usize, "accessor length");
        values
    }

    fn vectors(&self, index: &Value) -> Vec<Vec3> {
        self.accessor(index).chunks_exact(3).map(|v| Vec3::new(v[0] as f32, v[1] as f32, v[2] as f32)).collect()
    }

    fn list(&self, key: &str) -> &[Value] {
        self.json[key].as_array().map_or(&[], Vec::as_slice)
    }
}

/// Triangles and vertices of one primitive, after checking it.
fn check_primitive(glb: &Glb, primitive: &Value, whose: &str) -> (usize, usize) {
    let attributes = &primitive["attributes"];
    let positions = glb.vectors(&attributes["POSITION"]);
    let normals = glb.vectors(&attributes["NORMAL"]);
    let indices: Vec<usize> = glb.accessor(&primitive["indices"]).into_iter().map(|i| i as usize).collect();
    assert_eq!(positions.len(), normals.len(), "{whose}");
    assert!(positions.iter().all(|p| p.is_finite()), "{whose}: positions are finite");
    if let Some(n) = normals.iter().find(|n| (n.length() - 1.0).abs() > 1e-5) {
        panic!("{whose}: normal {n} has length {}", n.length());
    }
    if !attributes["TEXCOORD_0"].is_null() {
        assert_eq!(glb.accessor(&attributes["TEXCOORD_0"]).len(), 2 * positions.len(), "{whose}");
    }
    assert!((primitive["material"].as_u64().unwrap() as usize) < glb.list("materials").len(), "{whose}");
    let mut used = vec![false; positions.len()];
    for triangle in indices.chunks(3) {
        let [a, b, c] = [triangle[0], triangle[1], triangle[2]];
        assert!(a.max(b).max(c) < positions.len(), "{whose}: triangle {triangle:?} of {} vertices", positions.len());
        let area_normal = (positions[b] - positions[a]).cross(positions[c] - positions[a]);
        assert!(area_normal.length() > 1e-9, "{whose}: triangle {triangle:?} has no area");
        let shading = normals[a] + normals[b] + normals[c];
        assert!(area_normal.dot(shading) > 0.0, "{whose}: triangle {triangle:?} is wound against its normals");
        [a, b, c].into_iter().for_each(|i| used[i] = true);
    }
    assert!(used.iter().all(|u| *u), "{whose}: every vertex is used");
    (indices.len() / 3, positions.len())
}

/// Triangles and vertices as drawn, instances counted each.
fn check_scene(name: &str, bytes: &[u8]) -> (usize, usize) {
    let glb = Glb::parse(bytes);
    let meshes: Vec<(usize, usize)> = glb
        .list("meshes")
        .iter()
        .map(|mesh| {
            let whose = format!("{name}: mesh {}", mesh["name"]);
            let parts = mesh["primitives"].as_array().unwrap().iter();
            parts.map(|p| check_primitive(&glb, p, &whose)).fold((0, 0), |s, p| (s.0 + p.0, s.1 + p.1))
        })
        .collect();
    let drawn = glb.list("nodes").iter().filter_map(|node| node["mesh"].as_u64());
    let total = drawn.map(|m| meshes[m as usize]).fold((0, 0), |s, p| (s.0 + p.0, s.1 + p.1));
    assert_eq!(glb.list("cameras")[0]["name"], "main", "{name}: the first camera");
    for material in glb.list("materials") {
        let factor = material["pbrMetallicRoughness"]["baseColorFactor"].as_array().unwrap();
        assert!(factor.iter().all(|c| (0.0..=1.0).contains(&c.as_f64().unwrap())), "{name}: {}", material["name"]);
    }
    let emits = glb.list("materials").iter().any(|m| !m["emissiveFactor"].is_null());
    let shines = !glb.json["extensions"]["KHR_lights_punctual"].is_null();
    assert!(emits || shines, "{name} has light");
    total
}

#[test]
fn every_scene_is_sound() {
    let mut sum = 0;
    for builtin in &builtin::BUILTINS {
        let Ok(Source::File(bytes)) = builtin::resolve(builtin.name) else { continue };
        let (triangles, vertices) = check_scene(builtin.name, bytes);
        println!("{:<22} {triangles:>7} triangles {vertices:>7} vertices {:>8} bytes", builtin.name, bytes.len());
        assert!(bytes.len() <= 400 << 10, "{} takes {} bytes, more than 400 KiB", builtin.name, bytes.len());
        sum += bytes.len();
    }
    assert!(sum <= 2500 << 10, "all scenes together take {sum} bytes, more than 2500 KiB");
}

#[test]
fn committed_files_are_what_the_source_makes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets");
    for (name, make) in scenes::ALL {
        let path = folder.join(format!("{name}.glb"));
        let committed = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert!(
            make().glb() == committed,
            "assets/{name}.glb is not what tools/make_scenes writes; run: cargo run --example make-scenes -- assets"
        );
    }
}

#[test]
fn every_file_has_a_name() {
    for (name, _) in scenes::ALL {
        assert!(builtin::resolve(name).is_ok(), "{name} is in src/scene/builtin.rs");
    }
}

#[test]
#[should_panic(expected = "wound against its normals")]
fn the_check_sees_a_triangle_turned_over() {
    let Ok(Source::File(bytes)) = builtin::resolve("furnace") else { panic!("furnace is a file") };
    let mut glb = Glb::parse(bytes);
    let primitive = glb.json["meshes"][0]["primitives"][0].clone();
    let accessor = &glb.json["accessors"][primitive["indices"].as_u64().unwrap() as usize];
    let view = &glb.json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
    let offset = view["byteOffset"].as_u64().unwrap() as usize;
    let first_two: [u8; 4] = glb.binary[offset..offset + 4].try_into().unwrap();
    let [a, b, c, d] = first_two;
    glb.binary[offset..offset + 4].copy_from_slice(&[c, d, a, b]);
    check_primitive(&glb, &primitive, "furnace");
}
