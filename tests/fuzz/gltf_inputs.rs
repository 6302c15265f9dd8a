//! Scenes: .glb and .gltf, bent in the JSON or in the data, and what the renderer makes of a scene on the host.

use crate::Target;
use crate::mutate::{self, Random};
use crate::sound::assert_sound;
use crate::support::{everything, glb, png, triangle};
use base64::Engine as _;
use glam::UVec2;
use linklight::scene::camera::View;
use linklight::scene::geometry::Geometry;
use linklight::scene::pose::Pose;
use linklight::scene::tessellate::{Fineness, tessellate};
use linklight::scene::{self, LoadOptions, adjacency, charts, deform};
use linklight::stages::clusters::{ClusterTree, MeshFaces};
use serde_json::Value;
use std::path::Path;

pub const GLTF: Target = Target { name: "gltf", runs: 500, seeds, mutate: bend, read, max_bytes: 6 * BUDGET as usize };

/// Of each step.
const BUDGET: u64 = 32 << 20;

/// What may stand in a document beside what does.
const WORDS: [&str; 44] = [
    "accessors",
    "bufferView",
    "byteOffset",
    "byteStride",
    "byteLength",
    "componentType",
    "count",
    "type",
    "sparse",
    "indices",
    "values",
    "SCALAR",
    "VEC2",
    "VEC3",
    "VEC4",
    "MAT4",
    "normalized",
    "uri",
    "data:;base64,AAAA",
    "../x.bin",
    "mode",
    "material",
    "POSITION",
    "NORMAL",
    "TANGENT",
    "TEXCOORD_0",
    "TEXCOORD_1",
    "COLOR_0",
    "JOINTS_0",
    "WEIGHTS_0",
    "targets",
    "skin",
    "children",
    "matrix",
    "translation",
    "rotation",
    "scale",
    "LINEAR",
    "STEP",
    "CUBICSPLINE",
    "weights",
    "KHR_materials_ior",
    "KHR_texture_transform",
    "extensions",
];

fn seeds() -> Vec<Vec<u8>> {
    let whole = everything();
    let mut textual = everything();
    let data = base64::engine::general_purpose::STANDARD.encode(&textual.binary);
    textual.json["buffers"][0]["uri"] = Value::from(format!("data:application/octet-stream;base64,{data}"));
    vec![
        whole.glb(),
        triangle().glb(),
        textual.json.to_string().into_bytes(),
        glb(br#"{"asset":{"version":"2.0"}}"#, b""),
    ]
}

/// The JSON and the data of a container, or of a plain document.
fn split(bytes: &[u8]) -> (Vec<u8>, Option<Vec<u8>>) {
    if !bytes.starts_with(b"glTF") {
        return (bytes.to_vec(), None);
    }
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let data = bytes.get(20 + length + 8..).unwrap_or_default();
    (bytes[20..20 + length].to_vec(), Some(data.to_vec()))
}

fn bend(random: &mut Random, seeds: &[Vec<u8>]) -> Vec<u8> {
    let seed = if random.one_in(2) { &seeds[0] } else { random.pick(seeds) };
    if random.one_in(8) {
        return mutate::bytes(random, seed.clone());
    }
    let (json, data) = split(seed);
    let mut document: Value = serde_json::from_slice(&json).expect("a valid seed");
    if !random.one_in(4) {
        mutate::document(random, &mut document, &WORDS);
    }
    let json = document.to_string().into_bytes();
    match data {
        None => json,
        Some(data) => {
            let data = if random.one_in(2) && !data.is_empty() { mutate::bytes(random, data) } else { data };
            glb(&json, &data)
        }
    }
}

fn read(input: &[u8], _: &Path) {
    let options = LoadOptions { scene: None, max_memory_bytes: BUDGET };
    let Ok(scene) = scene::load_bytes_with("fuzz", input, &options) else { return };
    assert_sound(&scene, "a bent scene");
    assert!(scene.size_bytes() <= BUDGET, "{} bytes of a budget of {BUDGET}", scene.size_bytes());
    let Ok(geometry) = Geometry::flatten(&scene, BUDGET) else { return };
    for seconds in [0.0, 0.4, 1e6] {
        let pose = Pose::at(&scene, seconds);
        let vertices = deform::world_vertices(&geometry, &pose);
        let bounds = vertices.bounds().filter(|[low, high]| low.is_finite() && high.is_finite());
        // Too degenerate to be seen is an answer too.
        drop(View::of_scene(&scene, &pose, None, bounds, UVec2::new(16, 9)));
    }
    let rest = Pose::rest(&scene);
    let Ok(cut) = tessellate(geometry, &rest, Fineness::Elements(60), BUDGET) else { return };
    let (geometry, positions) = (&cut.geometry, &cut.rest_positions);
    if geometry.triangles.len() > 2_000 {
        return;
    }
    adjacency::weld(positions).members();
    adjacency::one_ring(geometry.vertex_count(), &geometry.triangles);
    charts::unwrap(&charts::Surface::of(geometry, positions), &charts::Options::default());
    let ones = vec![glam::Vec3::ONE; geometry.triangles.len()];
    let mesh =
        MeshFaces { positions, triangles: &geometry.triangles, albedo: &ones, reflectance: &ones, emission: &ones };
    let tree = ClusterTree::build(&mesh);
    assert_eq!(tree.faces.len(), geometry.triangles.len(), "each triangle has its place in the tree");
}

pub fn seeds_are_valid() {
    for seed in seeds() {
        let scene = scene::load_bytes("seed", &seed).unwrap_or_else(|error| panic!("{error}"));
        let no_scene = scene.notes.iter().all(|note| note.contains("no scene"));
        assert!(no_scene, "{:?}", scene.notes);
        read(&seed, Path::new(""));
    }
    assert!(png(1, 1).starts_with(b"\x89PNG"));
}
