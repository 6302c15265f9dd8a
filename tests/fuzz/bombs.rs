//! Small files that ask for very much: refused before it is allocated, in little time.

use crate::support::{Builder, triangle};
use crate::{ALLOCATOR, TURN};
use linklight::report::image;
use linklight::scene::environment::load::{self as environment, EnvironmentLimits};
use linklight::scene::geometry::Geometry;
use linklight::scene::{self, LoadOptions};
use serde_json::{Value, json};
use std::path::Path;
use std::time::{Duration, Instant};

/// What each may take at most; each asks for a hundred times that or more.
const MAX_BYTES: usize = 48 << 20;
const BUDGET: u64 = 32 << 20;

/// Runs `load`, which must be refused for a reason that holds `part`, within the bounds.
#[track_caller]
fn refused(what: &str, part: &str, load: impl FnOnce() -> Result<(), String>) {
    let (held, start) = (ALLOCATOR.current_usage(), Instant::now());
    ALLOCATOR.reset_peak_usage();
    let result = load();
    let bytes = ALLOCATOR.peak_usage().saturating_sub(held);
    let message = result.expect_err(what);
    assert!(message.contains(part), "{what}: {part:?} is not in {message:?}");
    assert!(bytes < MAX_BYTES, "{what}: {bytes} bytes were taken");
    assert!(start.elapsed() < Duration::from_secs(20), "{what}: {:?}", start.elapsed());
}

/// Loads a scene and lays it out for the stages.
fn load(bytes: &[u8]) -> Result<(), String> {
    let options = LoadOptions { scene: None, max_memory_bytes: BUDGET };
    let scene = scene::load_bytes_with("bomb.glb", bytes, &options).map_err(|error| error.to_string())?;
    Geometry::flatten(&scene, BUDGET).map(drop).map_err(|error| error.to_string())
}

fn bomb(build: impl FnOnce(&mut Builder)) -> Vec<u8> {
    let mut builder = triangle();
    build(&mut builder);
    builder.glb()
}

#[test]
fn scenes_that_share_without_end_are_refused() {
    let _turn = TURN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    // Each node names all of the next rank, twice over: 2^40 instances.
    let doubled = bomb(|b| {
        let node = |rank: usize| json!({ "children": [rank + 1, rank + 1] });
        let ranks: Vec<Value> = (0..40).map(node).chain([json!({ "mesh": 0 })]).collect();
        b.json["nodes"] = json!(ranks);
    });
    refused("2^40 instances", "/nodes/0/children/1: must name a node that has no other parent", || load(&doubled));
    // One mesh of some size, shown very often.
    let shown_often = bomb(|b| {
        let positions: Vec<f32> = (0..90_000u64).map(|i| ((i * i) % 1009) as f32).collect();
        let positions = b.floats("VEC3", &positions);
        b.json["meshes"][0]["primitives"][0] = json!({ "attributes": { "POSITION": positions } });
        b.json["nodes"] = json!(vec![json!({ "mesh": 0 }); 20_000]);
        b.json["scenes"][0]["nodes"] = json!((0..20_000).collect::<Vec<_>>());
    });
    refused("600 million vertices by instances", "--max-memory", || load(&shown_often));
    // One array, named by many primitives, morph targets, and animations.
    let long = |b: &mut Builder| b.floats("VEC3", &vec![1.0; 90_000]);
    let primitives = bomb(|b| {
        let primitive = json!({ "attributes": { "POSITION": long(b) } });
        b.json["meshes"][0]["primitives"] = json!(vec![primitive; 20_000]);
    });
    refused("one array as many primitives", "memory budget", || load(&primitives));
    let morphed = bomb(|b| {
        let positions: Vec<f32> = (0..90_000u64).map(|i| ((i * i) % 1009) as f32).collect();
        let positions = b.floats("VEC3", &positions);
        let targets = vec![json!({ "POSITION": positions }); 20_000];
        b.json["meshes"][0]["primitives"][0] = json!({ "attributes": { "POSITION": positions }, "targets": targets });
    });
    refused("one array as many morph targets", "memory budget", || load(&morphed));
    let animated = bomb(|b| {
        let times: Vec<f32> = (0..30_000).map(|i| i as f32).collect();
        let (input, output) = (b.floats("SCALAR", &times), long(b));
        let animation = json!({
            "samplers": [{ "input": input, "output": output }],
            "channels": [{ "sampler": 0, "target": { "node": 0, "path": "translation" } }],
        });
        b.json["animations"] = json!(vec![animation; 20_000]);
    });
    refused("one track as many animations", "memory budget", || load(&animated));
}

#[test]
fn counts_without_data_are_refused() {
    let _turn = TURN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let sparse = bomb(|b| {
        let (indices, values) = (b.view(&[5]), b.view(&[0; 12]));
        let sparse = json!({
            "count": 1,
            "indices": { "bufferView": indices, "componentType": 5121 },
            "values": { "bufferView": values },
        });
        b.json["accessors"][0] =
            json!({ "componentType": 5126, "type": "VEC3", "count": 1_000_000_000, "sparse": sparse });
        b.json["meshes"][0]["primitives"][0] = json!({ "attributes": { "POSITION": 0 } });
    });
    refused("a sparse accessor of 10^9", "bytes are needed", || load(&sparse));
    let nested = format!("{{\"asset\":{{\"version\":\"2.0\"}},\"extras\":{}", "[".repeat(4 << 20));
    refused("JSON four million levels deep", "memory budget", || load(nested.as_bytes()));
    let nested = format!("{{\"asset\":{{\"version\":\"2.0\"}},\"extras\":{}", "[".repeat(1 << 16));
    refused("JSON 65536 levels deep", "recursion limit", || load(nested.as_bytes()));
    let data = "A".repeat(20 << 20);
    let uris = bomb(|b| {
        let uri = |_| json!({ "byteLength": 15 << 20, "uri": format!("data:;base64,{data}") });
        b.json["buffers"] = json!((0..1).map(uri).collect::<Vec<_>>());
    });
    refused("a data URI beyond the budget", "the data URI at /buffers/0/uri", || load(&uris));
}

#[test]
fn pictures_that_only_claim_to_be_vast_are_refused() {
    let _turn = TURN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let limits = EnvironmentLimits { max_extent: 16384, max_memory_bytes: BUDGET };
    let environment = |bytes: &[u8]| {
        let loaded = environment::load_bytes(Path::new("bomb"), bytes, 0.0, &limits);
        loaded.map(drop).map_err(|error| error.to_string())
    };
    let hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 16384 +X 16384\n\x02\x02\x40\x00".to_vec();
    refused("an .hdr of 16384 x 16384", "--max-memory", || environment(&hdr));
    let hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 65536 +X 65536\n\x02\x02\x40\x00".to_vec();
    refused("an .hdr of 65536 x 65536", "65536", || environment(&hdr));

    // A small .exr whose window is made vast.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("small.exr");
    let small = image::Picture::new(8, 4, vec![glam::Vec3::ONE; 32]).unwrap();
    image::write_exr(&path, &small).unwrap();
    let mut exr = std::fs::read(&path).unwrap();
    for side in [16383i32, 65535] {
        for window in ["dataWindow\0", "displayWindow\0"] {
            let at = exr.windows(window.len()).position(|bytes| bytes == window.as_bytes()).unwrap();
            let corner = at + window.len() + "box2i\0".len() + 4 + 8;
            exr[corner..corner + 4].copy_from_slice(&side.to_le_bytes());
            exr[corner + 4..corner + 8].copy_from_slice(&side.to_le_bytes());
        }
        refused("a vast .exr as environment", "bomb", || environment(&exr));
        std::fs::write(&path, &exr).unwrap();
        let read = || image::read(&path).map(drop).map_err(|error| error.to_string());
        refused("a vast .exr as picture", "small.exr", read);
    }

    // Text that unpacks to a thousand times its size is left out, and the picture read.
    let path = folder.path().join("text.png");
    let mut file = std::fs::File::create(&path).unwrap();
    let mut writer = png::Encoder::new(&mut file, 1, 1).write_header().unwrap();
    let mut chunk = png::text_metadata::ITXtChunk::new("Comment", "\0".repeat(96 << 20));
    chunk.compressed = true;
    writer.write_text_chunk(&chunk).unwrap();
    writer.write_image_data(&[0]).unwrap();
    writer.finish().unwrap();
    drop(chunk);
    refused("96 MiB of text in a .png", "read without it", || {
        let picture = image::read(&path).map_err(|error| error.to_string())?;
        if picture.metadata.contains_key("Comment") { Ok(()) } else { Err("read without it".into()) }
    });
}
