//! The shared collection of bad files: the negative tests of the Khronos validator and of the asset generator, and
//! files that need what we lack. Each is loaded as it stands, and again with everything in it put into a scene.

use crate::conformance::assert_sound;
use crate::support::{gltf_files, shared};
use linklight::scene::gltf::Fault;
use linklight::scene::{self, LoadOptions, SceneError};
use serde_json::{Value, json};
use std::collections::HashMap;
use std::path::Path;
use std::time::{Duration, Instant};

/// No file of the collection needs more than a few milliseconds; the slowest machine gets a hundred times that.
const MAX_TIME: Duration = Duration::from_secs(5);

/// Loads within bounds; a scene must keep its promises, an error must say where or which rule, and what to do.
fn load(path: &Path, name: &str) -> Result<scene::Scene, SceneError> {
    let options = LoadOptions { max_memory_bytes: 256 << 20, scene: None };
    let start = Instant::now();
    let result = scene::load(path, &options);
    assert!(start.elapsed() < MAX_TIME, "{name}: {:?}", start.elapsed());
    match &result {
        Ok(scene) => assert_sound(scene, name),
        Err(error) => {
            let message = error.fault.to_string();
            let has_advice = message.contains("; ");
            let says_where = match &error.fault {
                Fault::Invalid { pointer, .. } => pointer.starts_with('/') || pointer == "the document",
                _ => true,
            };
            assert!(has_advice && says_where && message.len() < 600, "{name}: {message}");
        }
    }
    result
}

/// Rows of a manifest by file name.
fn manifest(folder: &Path) -> HashMap<String, Vec<String>> {
    let text = std::fs::read_to_string(folder.join("MANIFEST.tsv")).unwrap();
    let cells = |row: &str| row.split('\t').map(str::to_owned).collect::<Vec<_>>();
    text.lines().skip(1).map(cells).map(|cells| (cells[0].clone(), cells)).collect()
}

#[test]
fn what_the_validator_passes_loads_and_what_cannot_be_read_is_refused() {
    let Some(folder) = shared("bad-gltf/validator") else { return };
    let manifest = manifest(&folder);
    let mut checked = 0;
    for file in gltf_files(&folder) {
        let name = file.strip_prefix(&folder).unwrap().to_string_lossy().replace('\\', "/");
        let row = &manifest[&name];
        let result = load(&file, &name);
        let is_passed = row[1] == "0";
        let is_excepted = [
            // A minimum version above 2.0 passes with a warning, and readers of 2.0 must refuse it (glTF 2.0, 3.2).
            "base/data/asset/min_version_valid.gltf",
            // Their shapes are in buffers that have no data, which the schema allows.
            "base/data/root/named_objects.gltf",
            "base/data/root/unused_objects.gltf",
        ]
        .contains(&name.as_str());
        if is_passed {
            assert_eq!(result.is_err(), is_excepted, "{name}: {:?}", result.err().map(|error| error.to_string()));
        }
        let fatal = [
            "GLB_CHUNK_TOO_BIG",
            "GLB_DUPLICATE_CHUNK",
            "GLB_INVALID_MAGIC",
            "GLB_INVALID_VERSION",
            "GLB_LENGTH_MISMATCH",
            "GLB_LENGTH_TOO_SMALL",
            "GLB_UNEXPECTED_BIN_CHUNK",
            "GLB_UNEXPECTED_END_OF_CHUNK_DATA",
            "GLB_UNEXPECTED_END_OF_CHUNK_HEADER",
            "GLB_UNEXPECTED_END_OF_HEADER",
            "GLB_UNEXPECTED_FIRST_CHUNK",
            "NODE_LOOP",
            "NODE_PARENT_OVERRIDE",
            "SCENE_NON_ROOT_NODE",
            "UNKNOWN_ASSET_MAJOR_VERSION",
            "UNUSED_EXTENSION_REQUIRED",
        ];
        if row[3].split(',').any(|code| fatal.contains(&code)) {
            assert!(result.is_err(), "{name}: {}", row[3]);
        }
        if row[3].split(',').any(|code| code == "INVALID_JSON") && !name.contains("bom") {
            assert!(matches!(result.unwrap_err().fault, Fault::Json { .. } | Fault::Container { .. }), "{name}");
        }
        checked += 1;
    }
    assert_eq!(checked, manifest.len());
}

#[test]
fn what_needs_more_than_we_have_is_refused_by_name() {
    let Some(folder) = shared("bad-gltf/unsupported") else { return };
    let manifest = manifest(&folder);
    for (name, row) in &manifest {
        let result = load(&folder.join(name), name);
        let what = &row[1];
        let required: &[&str] = match name.as_str() {
            // Listed as valid with quantisation alone, but its compression is required too.
            "mesh_quantization.glb" => &["EXT_meshopt_compression"],
            "UnsupportedRequiredExtensions.gltf" => &["EXT_lights_image_based", "KHR_xmp"],
            _ if what.contains("glTF 1.0") => {
                assert!(matches!(result.unwrap_err().fault, Fault::Version { .. }), "{name}");
                continue;
            }
            _ if what.contains("meshopt") => &["EXT_meshopt_compression"],
            _ if what.contains("webp") => &["KHR_draco_mesh_compression", "EXT_texture_webp"],
            _ if what.to_lowercase().contains("draco") => &["KHR_draco_mesh_compression"],
            _ if what.contains("VALID") => {
                let scene = result.unwrap_or_else(|error| panic!("{error}"));
                assert!(scene.meshes.iter().any(|mesh| !mesh.primitives.is_empty()), "{name}");
                continue;
            }
            other => panic!("{other}: {what}"),
        };
        let error = result.expect_err(name);
        assert!(matches!(error.fault, Fault::RequiredExtension { .. }), "{error}");
        required.iter().for_each(|extension| assert!(error.to_string().contains(extension), "{error}"));
    }
}

#[test]
fn generated_negatives_end_in_notes_or_errors() {
    let Some(folder) = shared("bad-gltf/generator_negative") else { return };
    for (name, row) in manifest(&folder) {
        let result = load(&folder.join(&name), &name);
        if row[1].contains("no POSITION") {
            let notes = result.unwrap_or_else(|error| panic!("{error}")).notes;
            assert!(notes.iter().any(|note| note.contains("without POSITION")), "{name}: {notes:?}");
            continue;
        }
        // Numbers 00 to 07 are points and lines; 08 and on are triangles.
        let number: u32 = name[name.len() - "00.gltf".len()..][..2].parse().unwrap();
        match number < 8 {
            true => assert!(result.unwrap().notes.iter().any(|note| note.contains("not drawn")), "{name}"),
            false => assert!(result.unwrap_err().to_string().contains("restarts primitives"), "{name}"),
        }
    }
}

/// Most of the validator's files have no scene, so that nothing would look at their broken meshes: put them in one.
#[test]
fn broken_parts_are_harmless_once_a_scene_uses_them() {
    let Some(folder) = shared("bad-gltf") else { return };
    let copies = tempfile::tempdir().unwrap();
    let (mut refused, mut loaded) = (0, 0);
    for (number, file) in gltf_files(&folder).into_iter().enumerate() {
        let name = file.strip_prefix(&folder).unwrap().to_string_lossy().into_owned();
        let parsed = std::fs::read(&file).ok().and_then(|bytes| serde_json::from_slice::<Value>(&bytes).ok());
        let Some(mut document) = parsed.filter(Value::is_object) else { continue };
        show_everything(&mut document);
        let copy = copies.path().join(number.to_string());
        std::fs::create_dir(&copy).unwrap();
        for entry in std::fs::read_dir(file.parent().unwrap()).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|extension| extension == "bin" || extension == "png") {
                std::fs::copy(&path, copy.join(path.file_name().unwrap())).unwrap();
            }
        }
        let path = copy.join("scene.gltf");
        std::fs::write(&path, document.to_string()).unwrap();
        match load(&path, &name) {
            Ok(_) => loaded += 1,
            Err(_) => refused += 1,
        }
    }
    // Both happen a lot; were all refused or all loaded, this would look at nothing.
    assert!(refused > 50 && loaded > 250, "{refused} refused, {loaded} loaded");
}

/// Adds nodes for every mesh (with every material), camera, light and skin, and makes one scene of all root nodes.
fn show_everything(document: &mut Value) {
    let count = |list: &Value| list.as_array().map_or(0, Vec::len);
    let lights = count(&document["extensions"]["KHR_lights_punctual"]["lights"]);
    let (meshes, cameras, skins) = (count(&document["meshes"]), count(&document["cameras"]), count(&document["skins"]));
    let materials = count(&document["materials"]);
    let mut added: Vec<Value> = Vec::new();
    for mesh in 0..meshes {
        added.push(json!({ "mesh": mesh }));
        (0..skins).for_each(|skin| added.push(json!({ "mesh": mesh, "skin": skin })));
    }
    added.extend((0..cameras).map(|camera| json!({ "camera": camera })));
    added.extend((0..lights).map(|light| json!({ "extensions": { "KHR_lights_punctual": { "light": light } } })));

    // One triangle of zeros for each material, so that its textures are looked at.
    let Some(root) = document.as_object_mut() else { return };
    let mut push = |list: &str, value: Value| {
        let list = root.entry(list).or_insert_with(|| json!([]));
        list.as_array_mut().map(|list| {
            list.push(value);
            list.len() - 1
        })
    };
    if materials > 0 {
        let accessor = push("accessors", json!({ "componentType": 5126, "type": "VEC3", "count": 3 }));
        for material in 0..materials {
            let primitive = json!({ "attributes": { "POSITION": accessor }, "material": material });
            if let Some(mesh) = push("meshes", json!({ "primitives": [primitive] })) {
                added.push(json!({ "mesh": mesh }));
            }
        }
    }
    for node in added {
        push("nodes", node);
    }
    if let Some(nodes) = document["nodes"].as_array() {
        let children: Vec<u64> =
            nodes.iter().filter_map(|node| node["children"].as_array()).flatten().filter_map(Value::as_u64).collect();
        let roots: Vec<u64> = (0..nodes.len() as u64).filter(|node| !children.contains(node)).collect();
        document["scenes"] = json!([{ "nodes": roots }]);
        if let Some(root) = document.as_object_mut() {
            root.remove("scene");
        }
    }
}
