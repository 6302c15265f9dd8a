//! Bad glTF files end in a clean error, or in a scene with a note where a viewer would reasonably go on: never in a
//! panic, and never in more time or memory than the file's own bytes and the stated budget account for.

use crate::support::{Builder, glb, triangle};
use linklight::scene::gltf::Fault;
use linklight::scene::{self, LoadOptions, Scene};
use serde_json::json;

fn load(builder: &Builder) -> Result<Scene, scene::SceneError> {
    scene::load_bytes("test.glb", &builder.glb())
}

/// The scene is refused with a message that holds all of `parts`.
#[track_caller]
fn refused(result: Result<Scene, scene::SceneError>, parts: &[&str]) {
    let message = result.expect_err("a refusal").to_string();
    assert!(message.starts_with("test.glb: "), "{message}");
    for part in parts {
        assert!(message.contains(part), "{part:?} is not in {message:?}");
    }
}

/// Spoils the triangle of the support module, which is sound before; the result is refused with `parts`.
#[track_caller]
fn spoilt(spoil: impl FnOnce(&mut Builder), parts: &[&str]) {
    let mut builder = triangle();
    assert_eq!(load(&builder).expect("a sound triangle").meshes[0].primitives[0].triangles.len(), 1);
    spoil(&mut builder);
    refused(load(&builder), parts);
}

/// Spoils the triangle; it still loads, with a note that holds `part`.
#[track_caller]
fn noted(spoil: impl FnOnce(&mut Builder), part: &str) -> Scene {
    let mut builder = triangle();
    assert!(load(&builder).expect("a sound triangle").notes.is_empty());
    spoil(&mut builder);
    let scene = load(&builder).unwrap_or_else(|error| panic!("{error}"));
    assert!(scene.notes.iter().any(|note| note.contains(part)), "{part:?} is not in {:?}", scene.notes);
    scene
}

#[test]
fn broken_containers_are_refused() {
    let good = triangle().glb();
    for length in 0..good.len() {
        scene::load_bytes("test.glb", &good[..length]).expect_err("a file cut short");
    }
    let patched = |at: usize, value: u32| {
        let mut bytes = good.clone();
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        scene::load_bytes("test.glb", &bytes)
    };
    refused(patched(4, 1), &["glTF 1", "only version 2.0"]);
    refused(patched(8, 0), &["length in its header", "it says 0"]);
    refused(patched(8, u32::MAX), &["length in its header", "4294967295"]);
    refused(patched(12, u32::MAX), &["chunk 0 says 4294967295 bytes"]);
    refused(patched(12, 0), &["container is broken"]);
    refused(patched(16, 0x004e_4942), &["first chunk is the JSON"]);
    refused(scene::load_bytes("test.glb", b""), &["JSON cannot be parsed: it is empty"]);
    refused(scene::load_bytes("test.glb", b"glTF"), &["header has 12 bytes"]);

    let json_chunk = [&4u32.to_le_bytes()[..], b"JSON{}  "].concat();
    let mut twice = good.clone();
    twice.extend_from_slice(&json_chunk);
    let length = twice.len() as u32;
    twice[8..12].copy_from_slice(&length.to_le_bytes());
    refused(scene::load_bytes("test.glb", &twice), &["one JSON chunk"]);
}

#[test]
fn broken_json_is_refused() {
    let json = |text: &[u8]| scene::load_bytes("test.glb", text);
    refused(json(b"{"), &["JSON cannot be parsed"]);
    refused(json(b"[]"), &["the document: must be an object"]);
    refused(json(b"{}"), &["/asset: is required"]);
    refused(json(b"{\"asset\":{\"version\":\"\xff\xfe\"}}"), &["JSON cannot be parsed"]);
    refused(json(&b"[".repeat(1 << 20)), &["JSON cannot be parsed", "recursion limit"]);
    let nested = [&b"{\"extras\":"[..], &b"[".repeat(1 << 16)].concat();
    refused(json(&nested), &["recursion limit"]);
    refused(json(br#"{"asset":{"version":"2.0"},"nodes":{}}"#), &["/nodes: must be an array"]);
    refused(json(br#"{"asset":{"version":"2.0"},"nodes":[3]}"#), &["/nodes/0: must be an object, but it is 3"]);
    refused(json(br#"{"asset":{"version":"2.0"},"nodes":[{"translation":[1,2,1e39]}]}"#), &["/nodes/0/translation/2"]);
    refused(json(br#"{"asset":{"version":"2.0"},"nodes":[{"scale":[1,2]}]}"#), &["must hold 3 numbers", "2 numbers"]);
}

#[test]
fn other_versions_are_refused_by_version() {
    for (asset, seen) in [
        (json!({ "version": "1.0" }), "glTF \"1.0\""),
        (json!({ "version": "3.0" }), "glTF \"3.0\""),
        (json!({ "version": "2.1", "minVersion": "2.1" }), "glTF \"2.1\""),
    ] {
        spoilt(|b| b.json["asset"] = asset, &[seen, "only version 2.0 can be read"]);
    }
    spoilt(|b| b.json["asset"] = json!({ "version": "two" }), &["/asset/version", "\"two\""]);
    let old = json!({ "accessors": {}, "meshes": {} }).to_string();
    refused(scene::load_bytes("test.glb", old.as_bytes()), &["glTF 1.0"]);
    noted(|b| b.json["asset"] = json!({ "version": "2.1", "minVersion": "2.0" }), "read as 2.0");
}

#[test]
fn required_extensions_are_refused_by_name_and_optional_ones_noted_once() {
    let names = json!(["KHR_texture_transform", "KHR_draco_mesh_compression", "ACME_x"]);
    spoilt(|b| b.json["extensionsRequired"] = names, &["\"KHR_draco_mesh_compression\", \"ACME_x\"", "supported are"]);
    let names = json!(["KHR_texture_transform", "ACME_x", "ACME_x"]);
    let scene = noted(|b| b.json["extensionsUsed"] = names, "optional extension \"ACME_x\"");
    assert_eq!(scene.notes.len(), 1);
    // Terminal control sequences of the file do not reach the terminal, and long text does not fill it.
    let name = format!("\u{1b}[31m{}", "x".repeat(1 << 20));
    let mut builder = triangle();
    builder.json["extensionsRequired"] = json!([name]);
    let message = load(&builder).expect_err("a refusal").to_string();
    assert!(!message.contains('\u{1b}') && message.len() < 1000);
}

#[test]
fn accessors_must_lie_within_their_views() {
    let at = |key: &str| format!("/accessors/0/{key}");
    spoilt(
        |b| b.json["accessors"][0]["count"] = json!(4),
        &["/accessors/0: must end within the 36 bytes", "4 elements"],
    );
    spoilt(|b| b.json["accessors"][0]["count"] = json!(0), &[&at("count"), "but it is 0"]);
    spoilt(|b| b.json["accessors"][0]["count"] = json!(-3), &[&at("count"), "but it is -3"]);
    spoilt(|b| b.json["accessors"][0]["count"] = json!(2.5), &[&at("count"), "but it is 2.5"]);
    spoilt(|b| b.json["accessors"][0]["count"] = json!(4_294_967_295u64), &["/accessors/0: must end within"]);
    spoilt(|b| b.json["accessors"][0]["count"] = json!(u64::MAX), &[&at("count")]);
    spoilt(|b| b.json["accessors"][0]["byteOffset"] = json!(4), &["must end within the 36 bytes", "from byte 4"]);
    spoilt(|b| b.json["accessors"][0]["byteOffset"] = json!(u64::MAX - 3), &["/accessors/0"]);
    spoilt(|b| b.json["accessors"][0]["byteOffset"] = json!(2), &[&at("byteOffset"), "multiple of 4", "but it is 2"]);
    spoilt(|b| b.json["accessors"][0]["componentType"] = json!(5124), &[&at("componentType"), "5126 (FLOAT)"]);
    spoilt(|b| b.json["accessors"][0]["type"] = json!("VEC5"), &[&at("type"), "\"VEC5\""]);
    spoilt(|b| b.json["accessors"][0]["type"] = json!("VEC4"), &["/accessors/0"]);
    spoilt(|b| b.json["accessors"][0]["type"] = json!("VEC2"), &["POSITION must be VEC3", "VEC2 of FLOAT"]);
    spoilt(|b| b.json["accessors"][0]["bufferView"] = json!(9), &["0 to 3", "but it is 9"]);
    let remove_view = |b: &mut Builder| drop(b.json["accessors"][0].as_object_mut().unwrap().remove("bufferView"));
    noted(remove_view, "1 degenerate triangles were dropped");
}

#[test]
fn views_and_buffers_must_hold_what_they_say() {
    let at = |key: &str| format!("/bufferViews/0/{key}");
    spoilt(|b| b.json["bufferViews"][0]["byteLength"] = json!(1 << 20), &["/bufferViews/0: must end within the"]);
    spoilt(|b| b.json["bufferViews"][0]["byteLength"] = json!(0), &[&at("byteLength"), "at least 1"]);
    spoilt(|b| b.json["bufferViews"][0]["byteOffset"] = json!(u64::MAX), &["/bufferViews/0: must end within the"]);
    spoilt(|b| b.json["bufferViews"][0]["byteStride"] = json!(0), &[&at("byteStride"), "from 4 to 252"]);
    spoilt(|b| b.json["bufferViews"][0]["byteStride"] = json!(13), &[&at("byteStride"), "but it is 13"]);
    spoilt(
        |b| b.json["bufferViews"][0]["byteStride"] = json!(8),
        &["must cover its elements of 12 bytes", "but it is 8"],
    );
    spoilt(|b| b.json["bufferViews"][0]["byteStride"] = json!(u64::MAX), &[&at("byteStride")]);
    spoilt(|b| b.json["bufferViews"][0]["buffer"] = json!(1), &[&at("buffer")]);
    spoilt(|b| b.json["buffers"] = json!([{ "byteLength": 1 << 30 }]), &["/buffers/0/byteLength", "bytes there are"]);
    spoilt(|b| b.json["buffers"] = json!([{ "byteLength": 0 }]), &["/bufferViews/0", "within the 0 bytes"]);
    spoilt(|b| b.json["buffers"] = json!([{}]), &["/buffers/0/byteLength: is required"]);
    spoilt(|b| b.binary.clear(), &["/bufferViews/0/buffer: refers to the buffers, of which the file has none"]);
}

#[test]
fn only_files_beside_the_scene_are_opened() {
    for (uri, rule) in [
        ("http://example.com/a.bin", "not other schemes"),
        ("file:///etc/passwd", "not other schemes"),
        ("/etc/passwd", "absolute paths"),
        ("../../etc/passwd", "must not leave the scene's folder"),
        ("%2e%2e/%2e%2e/etc/passwd", "must not leave the scene's folder"),
        ("a.bin", "embedded scene cannot refer to files"),
    ] {
        let buffer = json!([{ "byteLength": 100, "uri": uri }]);
        spoilt(|b| b.json["buffers"] = buffer, &["/buffers/0/uri", "is refused", rule]);
        let image = json!({ "uri": uri });
        spoilt(|b| texture(b, image), &["/images/0/uri", "is refused", rule]);
    }
    spoilt(|b| b.json["buffers"] = json!([{ "byteLength": 9, "uri": "data:;base64,????" }]), &["not decodable"]);
    spoilt(
        |b| b.json["buffers"] = json!([{ "byteLength": 9, "uri": "data:;base64,AAAA" }]),
        &["the 3 bytes there are"],
    );
}

#[test]
fn files_are_read_from_the_folder_and_pipes_are_not() {
    let folder = tempfile::tempdir().unwrap();
    let mut builder = triangle();
    builder.json["buffers"] = json!([{ "byteLength": builder.binary.len(), "uri": "sub/da%20ta.bin" }]);
    let path = folder.path().join("scene.gltf");
    std::fs::write(&path, builder.json.to_string()).unwrap();
    let load = || scene::load(&path, &LoadOptions::default());
    let missing = load().unwrap_err().to_string();
    assert!(missing.contains("cannot read") && missing.contains("da ta.bin"), "{missing}");
    std::fs::create_dir_all(folder.path().join("sub/da ta.bin")).unwrap();
    assert!(load().unwrap_err().to_string().contains("not a plain file"));
    std::fs::remove_dir(folder.path().join("sub/da ta.bin")).unwrap();
    std::fs::write(folder.path().join("sub/da ta.bin"), &builder.binary).unwrap();
    let scene = load().unwrap();
    assert_eq!((scene.name.as_str(), scene.meshes.len()), ("scene", 1));
    let error = scene::load(folder.path(), &LoadOptions::default()).unwrap_err();
    assert!(matches!(error.fault, Fault::Unreadable { .. }), "{error}");
}

#[test]
fn node_graphs_must_be_trees() {
    let nodes = |nodes: serde_json::Value| move |b: &mut Builder| b.json["nodes"] = nodes;
    let child = |index: usize| json!({ "children": [index] });
    spoilt(nodes(json!([child(0)])), &["/nodes/0", "own ancestor"]);
    spoilt(nodes(json!([{}, child(2), child(1)])), &["/nodes/1", "own ancestor"]);
    spoilt(nodes(json!([child(1), {}, child(1)])), &["/nodes/2/children/0", "child of node 0 already"]);
    spoilt(nodes(json!([{ "children": [1, 1] }, {}])), &["/nodes/0/children/1", "child of node 0 already"]);
    spoilt(nodes(json!([{}, child(0)])), &["/scenes/0/nodes/0", "a child of node 1"]);
    spoilt(nodes(json!([child(7)])), &["/nodes/0/children/0", "but it is 7"]);
    spoilt(|b| b.json["scenes"] = json!([{ "nodes": [0, 0] }]), &["/scenes/0/nodes/1", "must not name a node twice"]);
    spoilt(|b| b.json["scene"] = json!(1), &["/scene: must refer to one of the file's 1 scenes"]);
    // Each node names all of the next rank, twice over: 2^40 paths if it were followed.
    let doubled: Vec<_> = (0..40).map(|rank| json!({ "children": [rank + 1, rank + 1] })).chain([json!({})]).collect();
    spoilt(nodes(json!(doubled)), &["no other parent"]);
}

#[test]
fn a_chain_of_a_hundred_thousand_nodes_loads() {
    let mut builder = triangle();
    let mut nodes: Vec<_> = (0..100_000).map(|node| json!({ "children": [node + 1] })).collect();
    nodes.push(json!({ "mesh": 0 }));
    builder.json["nodes"] = json!(nodes);
    let scene = load(&builder).unwrap();
    assert_eq!(scene.nodes.len(), 100_001);
    assert!(scene.nodes.iter().enumerate().all(|(index, node)| node.parent.is_none_or(|p| (p as usize) < index)));
}

#[test]
fn transforms_must_be_finite_and_affine() {
    let mut matrix = [0.0; 16];
    spoilt(|b| b.json["nodes"][0]["matrix"] = json!(matrix), &["/nodes/0/matrix", "affine"]);
    matrix[15] = 1.0;
    spoilt(|b| b.json["nodes"][0]["matrix"] = json!(matrix[..15]), &["/nodes/0/matrix", "must hold 16 numbers"]);
    let scene = noted(|b| b.json["nodes"][0]["rotation"] = json!([0, 0, 0, 0]), "length zero");
    assert_eq!(scene.nodes[0].transform, scene::Transform::default());
    let mut builder = triangle();
    builder.json["nodes"][0]["rotation"] = json!([1e-30, 0, 0, 0]);
    let scene = load(&builder).unwrap();
    assert!(matches!(scene.nodes[0].transform, scene::Transform::Trs { rotation, .. } if rotation.is_normalized()));
}

#[test]
fn values_that_are_not_finite_are_refused() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for (accessor, offset) in [(0, 16), (1, 36 + 8), (2, 72)] {
            let spoil = |b: &mut Builder| b.binary[offset..offset + 4].copy_from_slice(&bad.to_le_bytes());
            spoilt(spoil, &[&format!("/accessors/{accessor}: must hold finite numbers"), "in element"]);
        }
    }
    // A vertex that no triangle uses does no harm.
    let mut builder = triangle();
    let positions = builder.floats("VEC3", &[0.0, 0.0, 0.0, f32::NAN, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    let indices = builder.u8s("SCALAR", &[0, 2, 3]);
    builder.json["meshes"][0]["primitives"][0] = json!({ "attributes": { "POSITION": positions }, "indices": indices });
    assert_eq!(load(&builder).unwrap().meshes[0].primitives[0].positions.len(), 3);
}

#[test]
fn indices_must_name_vertices() {
    let indices = |indices: &'static [u16]| {
        move |b: &mut Builder| b.json["meshes"][0]["primitives"][0]["indices"] = json!(b.u16s("SCALAR", indices))
    };
    spoilt(indices(&[0, 1, 3]), &["/accessors/4: must stay below the 3 vertices", "3 in element 2"]);
    spoilt(indices(&[0, 65535, 2]), &["/accessors/4", "restarts primitives", "65535 in element 1"]);
    spoilt(|b| b.json["meshes"][0]["primitives"][0]["indices"] = json!(0), &["indices must be SCALAR"]);
    spoilt(|b| b.json["meshes"][0]["primitives"][0]["mode"] = json!(7), &["/mode: must be from 0 to 6"]);
    spoilt(|b| b.json["accessors"][1]["count"] = json!(2), &["/accessors/1/count: NORMAL must have 3 elements"]);
    spoilt(|b| b.json["meshes"][0]["primitives"] = json!([]), &["/meshes/0/primitives"]);
    noted(|b| b.json["meshes"][0]["primitives"][0]["mode"] = json!(1), "Points and lines are not drawn");
    noted(indices(&[0, 0, 1]), "1 degenerate triangles were dropped");
    noted(|b| b.json["meshes"][0]["primitives"][0]["attributes"] = json!({}), "without POSITION");
}

#[test]
fn sparse_accessors_are_checked() {
    let sparse = |indices: &'static [u16], count: u64| {
        move |b: &mut Builder| {
            let view = b.view(&indices.iter().flat_map(|i| i.to_le_bytes()).collect::<Vec<_>>());
            let values = b.view(&vec![0; indices.len() * 12]);
            b.json["accessors"][0]["sparse"] = json!({
                "count": count,
                "indices": { "bufferView": view, "componentType": 5123 },
                "values": { "bufferView": values },
            });
        }
    };
    spoilt(sparse(&[1, 0], 2), &["/accessors/0/sparse/indices", "increase strictly", "0 at position 1"]);
    spoilt(sparse(&[1, 1], 2), &["increase strictly", "1 at position 1"]);
    spoilt(sparse(&[0, 3], 2), &["stay below 3", "3 at position 1"]);
    spoilt(sparse(&[0, 1], 4), &["/accessors/0/sparse/count", "from 1 to the accessor's 3"]);
    spoilt(sparse(&[0, 1], 0), &["/accessors/0/sparse/count"]);
    spoilt(sparse(&[0, 1], 3), &["/accessors/0/sparse/indices: must end within the 4 bytes"]);
    let without = |key: &'static str| {
        move |b: &mut Builder| {
            sparse(&[0, 1], 2)(b);
            drop(b.json["accessors"][0]["sparse"].as_object_mut().unwrap().remove(key));
        }
    };
    spoilt(without("indices"), &["/accessors/0/sparse/indices: is required"]);
    spoilt(without("values"), &["/accessors/0/sparse/values: is required"]);
}

/// Gives the triangle's material a texture with this image.
fn texture(builder: &mut Builder, image: serde_json::Value) {
    builder.push("images", image);
    builder.push("textures", json!({ "source": 0 }));
    builder.push("materials", json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }));
    builder.json["meshes"][0]["primitives"][0]["material"] = json!(0);
}

#[test]
fn huge_counts_in_tiny_files_do_not_allocate() {
    let unbacked = |count: u64| {
        move |b: &mut Builder| {
            b.json["accessors"][0] = json!({ "componentType": 5126, "type": "VEC3", "count": count });
            b.json["meshes"][0]["primitives"][0] = json!({ "attributes": { "POSITION": 0 } });
        }
    };
    spoilt(unbacked(100_000_000), &["/accessors/0: at most 16777216 elements without bufferView", "100000000"]);
    spoilt(unbacked(1_000_000_000), &["/accessors/0: at most 16777216 elements without bufferView", "1000000000"]);
    spoilt(unbacked(4_000_000_000), &["the triangles of /meshes/0/primitives/0", "bytes are needed", "memory budget"]);
    let sparse = |b: &mut Builder| {
        unbacked(1_000_000_000)(b);
        let (indices, values) = (b.view(&[5]), b.view(&[0; 12]));
        b.json["accessors"][0]["sparse"] = json!({
            "count": 1,
            "indices": { "bufferView": indices, "componentType": 5121 },
            "values": { "bufferView": values },
        });
    };
    spoilt(sparse, &["at most 16777216 elements without bufferView", "1000000000"]);
    // The same attribute, decoded for a hundred thousand primitives, is counted each time.
    let mut builder = triangle();
    let positions = builder.floats("VEC3", &vec![1.0; 300_000]);
    let primitive = json!({ "attributes": { "POSITION": positions } });
    builder.json["meshes"][0]["primitives"] = json!(vec![primitive; 100_000]);
    let options = LoadOptions { max_memory_bytes: 256 << 20, scene: None };
    refused(scene::load_bytes_with("test.glb", &builder.glb(), &options), &["memory budget"]);
}

#[test]
fn the_budget_is_what_the_caller_says() {
    let glb = triangle().glb();
    let with =
        |max_memory_bytes| scene::load_bytes_with("test.glb", &glb, &LoadOptions { max_memory_bytes, scene: None });
    let needed = (0..).map(|step| step * 64).find(|bytes| with(*bytes).is_ok()).unwrap();
    assert!((1000..20_000).contains(&needed), "{needed}");
    let error = with(needed / 2).unwrap_err();
    assert!(matches!(error.fault, Fault::OverBudget { needed, available, .. } if needed > available), "{error}");
}

#[test]
fn unreadable_images_leave_a_scene_without_them() {
    let png_header = |width: u32, height: u32| {
        let mut bytes = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec();
        bytes.extend_from_slice(&width.to_be_bytes());
        bytes.extend_from_slice(&height.to_be_bytes());
        bytes.extend_from_slice(&[8, 6, 0, 0, 0]);
        let crc = crc32(&bytes[12..]);
        bytes.extend_from_slice(&crc.to_be_bytes());
        bytes.extend_from_slice(b"\0\0\0\0IDAT");
        bytes
    };
    let embedded = |bytes: Vec<u8>| {
        move |b: &mut Builder| {
            let view = b.view(&bytes);
            texture(b, json!({ "bufferView": view }));
        }
    };
    for (bytes, part) in [
        (b"GIF89a..".to_vec(), "must be a PNG or a JPEG"),
        (png_header(65536, 65536), "must be from 1 to 16384 pixels a side, but it is 65536 x 65536"),
        (png_header(16385, 1), "16385 x 1"),
        (png_header(4, 4), "must be a readable PNG or JPEG"),
        (png_header(0, 4), "must be a readable PNG or JPEG"),
        (b"\xff\xd8\xff\xe0".to_vec(), "must be a readable PNG or JPEG"),
    ] {
        let scene = noted(embedded(bytes), part);
        assert!(scene.images.is_empty() && scene.textures.is_empty());
        assert_eq!(scene.materials[0].base_color_texture, None);
    }
    noted(|b| texture(b, json!({})), "either uri or bufferView, but it is neither");
    noted(|b| texture(b, json!({ "uri": "data:image/png;base64,!" })), "not decodable");
    let sourceless = |b: &mut Builder| {
        texture(b, json!({}));
        b.json["textures"] = json!([{}]);
    };
    noted(sourceless, "/textures/0 has no PNG or JPEG image");
    spoilt(
        |b| {
            texture(b, json!({}));
            b.json["textures"] = json!([]);
        },
        &["baseColorTexture/index: refers to the textures, of which the file has none"],
    );
    // A gigabyte of pixels, announced in a few bytes, is counted and not allocated.
    let mut builder = triangle();
    embedded(png_header(16384, 16384))(&mut builder);
    let options = LoadOptions { max_memory_bytes: 1 << 20, scene: None };
    refused(scene::load_bytes_with("test.glb", &builder.glb(), &options), &["16384 x 16384", "1073741824 bytes"]);
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 })
    })
}

#[test]
fn skins_need_every_joint_that_is_named() {
    let skinned = |joint: u8, joint_count: usize| {
        move |b: &mut Builder| {
            let joints = b.u8s("VEC4", &[joint; 12]);
            let weights = b.floats("VEC4", &[0.25; 12]);
            let attributes = &mut b.json["meshes"][0]["primitives"][0]["attributes"];
            attributes["JOINTS_0"] = json!(joints);
            attributes["WEIGHTS_0"] = json!(weights);
            let bones: Vec<_> = (0..joint_count).map(|_| b.push("nodes", json!({}))).collect();
            b.push("skins", json!({ "joints": bones }));
            b.json["nodes"][0]["skin"] = json!(0);
        }
    };
    spoilt(skinned(2, 2), &["/nodes/0/skin", "up to 2", "2 joints"]);
    spoilt(skinned(0, 0), &["/skins/0/joints"]);
    let mut builder = triangle();
    skinned(1, 2)(&mut builder);
    let scene = load(&builder).unwrap();
    assert_eq!((scene.nodes[0].skin, scene.skins[0].joints.as_slice()), (Some(0), &[1, 2][..]));
    let short = |b: &mut Builder| {
        skinned(1, 2)(b);
        b.json["skins"][0]["inverseBindMatrices"] = json!(b.floats("MAT4", &[0.0; 16]));
    };
    spoilt(short, &["must cover the 2 joints of /skins/0", "but it is 1"]);
}

#[test]
fn animations_that_cannot_be_played_are_left_out() {
    let animated = |times: &'static [f32], values: usize| {
        move |b: &mut Builder| {
            let input = b.floats("SCALAR", times);
            let output = b.floats("VEC3", &vec![0.0; values * 3]);
            b.push(
                "animations",
                json!({
                    "samplers": [{ "input": input, "output": output }],
                    "channels": [{ "sampler": 0, "target": { "node": 0, "path": "translation" } }],
                }),
            );
        }
    };
    let mut builder = triangle();
    animated(&[0.0, 1.0], 2)(&mut builder);
    assert_eq!(load(&builder).unwrap().clips[0].duration, 1.0);
    for (times, values, part) in [
        (&[0.0, 0.0][..], 2, "must increase, but it is 0 s in element 1"),
        (&[-1.0, 0.0], 2, "-1 s in element 0"),
        (&[0.0, f32::NAN], 2, "finite numbers"),
        (&[0.0, 1.0], 3, "must hold 2 values"),
    ] {
        assert!(noted(animated(times, values), part).clips.is_empty());
    }
    let dangling = |b: &mut Builder| {
        animated(&[0.0, 1.0], 2)(b);
        b.json["animations"][0]["channels"][0]["target"]["node"] = json!(5);
    };
    noted(dangling, "/animations/0/channels/0/target/node: must refer to one of the file's 1 nodes");
}

#[test]
fn embedded_json_may_be_followed_by_nothing() {
    let scene = scene::load_bytes("test.glb", &glb(br#"{"asset":{"version":"2.0"}}"#, b"")).unwrap();
    assert!(scene.nodes.is_empty() && scene.materials.len() == 1);
    assert!(scene.notes[0].contains("no scene"), "{:?}", scene.notes);
}
