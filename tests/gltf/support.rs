//! Small glTF files made in memory, and where the shared ones are.

use linklight::scene::gltf::Fault;
use linklight::scene::{Scene, SceneError};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// A glTF document and its one buffer, put together piece by piece and then bent at will.
pub struct Builder {
    pub json: Value,
    pub binary: Vec<u8>,
}

impl Builder {
    pub fn new() -> Self {
        Self { json: json!({ "asset": { "version": "2.0" } }), binary: Vec::new() }
    }

    /// Appends to a collection of the root; returns the index.
    pub fn push(&mut self, list: &str, value: Value) -> usize {
        let list = &mut self.json[list];
        if list.is_null() {
            *list = json!([]);
        }
        let list = list.as_array_mut().expect("a collection");
        list.push(value);
        list.len() - 1
    }

    /// A buffer view of these bytes.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let offset = self.binary.len();
        self.binary.extend_from_slice(bytes);
        self.push("bufferViews", json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() }))
    }

    /// An accessor of floats, of type `kind`.
    pub fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.accessor(kind, 5126, &bytes, 4)
    }

    pub fn u16s(&mut self, kind: &str, values: &[u16]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.accessor(kind, 5123, &bytes, 2)
    }

    pub fn u8s(&mut self, kind: &str, values: &[u8]) -> usize {
        self.accessor(kind, 5121, values, 1)
    }

    /// An accessor of all of `bytes`, its components `component_bytes` wide.
    pub fn accessor(&mut self, kind: &str, component: u32, bytes: &[u8], component_bytes: usize) -> usize {
        let components = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            "MAT4" => 16,
            other => panic!("{other}"),
        };
        let view = self.view(bytes);
        let count = bytes.len() / (components * component_bytes);
        let accessor = json!({ "bufferView": view, "componentType": component, "type": kind, "count": count });
        self.push("accessors", accessor)
    }

    /// A mesh of one primitive, shown by one node in a scene of its own.
    pub fn show(&mut self, primitive: Value) -> usize {
        let mesh = self.push("meshes", json!({ "primitives": [primitive] }));
        let node = self.push("nodes", json!({ "mesh": mesh }));
        self.push("scenes", json!({ "nodes": [node] }));
        mesh
    }

    /// The .glb; its buffer's length is set here, unless there is a buffer already.
    pub fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        let is_missing = json.as_object().is_some_and(|root| !root.contains_key("buffers"));
        if is_missing && !self.binary.is_empty() {
            json["buffers"] = json!([{ "byteLength": self.binary.len() }]);
        }
        glb(json.to_string().as_bytes(), &self.binary)
    }
}

/// A .glb container of these two chunks, padded as glTF asks.
pub fn glb(json: &[u8], binary: &[u8]) -> Vec<u8> {
    let mut bytes = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    let mut chunk = |kind: &[u8; 4], data: &[u8], padding: u8| {
        let length = data.len().next_multiple_of(4);
        bytes.extend_from_slice(&(length as u32).to_le_bytes());
        bytes.extend_from_slice(kind);
        bytes.extend_from_slice(data);
        bytes.resize(bytes.len() + length - data.len(), padding);
    };
    chunk(b"JSON", json, b' ');
    if !binary.is_empty() {
        chunk(b"BIN\0", binary, 0);
    }
    let length = bytes.len() as u32;
    bytes[8..12].copy_from_slice(&length.to_le_bytes());
    bytes
}

/// A triangle with normals, texture coordinates and colours, ready to be spoilt.
pub fn triangle() -> Builder {
    let mut builder = Builder::new();
    let position = builder.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    let normal = builder.floats("VEC3", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    let uv = builder.floats("VEC2", &[0.0, 1.0, 1.0, 1.0, 0.0, 0.0]);
    let indices = builder.u16s("SCALAR", &[0, 1, 2]);
    let attributes = json!({ "POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv });
    builder.show(json!({ "attributes": attributes, "indices": indices }));
    builder
}

/// The shared test inputs; `None` (said on standard error) where there are none.
pub fn shared(folder: &str) -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared");
    let path = std::env::var_os("LINKLIGHT_SHARED").map_or_else(beside, PathBuf::from).join(folder);
    if !path.is_dir() {
        eprintln!("skipped: {} does not exist (set LINKLIGHT_SHARED)", path.display());
        return None;
    }
    Some(path)
}

/// All glTF files in and below a folder, in order.
pub fn gltf_files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder that can be read") {
            let path = entry.expect("a folder entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "gltf" || extension == "glb") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// A file that uses every feature the loader reads, and none that it notes.
pub fn everything() -> Builder {
    let mut b = Builder::new();
    let names = ["KHR_lights_punctual", "KHR_texture_transform", "KHR_materials_emissive_strength"];
    b.json["extensionsUsed"] = json!(names);

    // A square of two triangles, skinned, morphed and coloured, with two sets of texture coordinates.
    let position = b.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0]);
    let normal = b.floats("VEC3", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    let uv_0 = b.floats("VEC2", &[0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0]);
    let uv_1 = b.u16s("VEC2", &[0, 65535, 65535, 65535, 0, 0, 65535, 0]);
    b.json["accessors"][uv_1]["normalized"] = json!(true);
    let color = b.u8s("VEC4", &[255; 16]);
    b.json["accessors"][color]["normalized"] = json!(true);
    let joints = b.u8s("VEC4", &[0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0]);
    let weights = b.floats("VEC4", &[0.5, 0.5, 0.0, 0.0].repeat(4));
    let indices = b.u16s("SCALAR", &[0, 1, 2, 3]);
    let moved = b.floats("VEC3", &[0.0; 12]);
    let (sparse_indices, sparse_values) = (b.view(&[1, 3]), b.view(&[0; 24]));
    b.json["accessors"][moved]["sparse"] = json!({
        "count": 2,
        "indices": { "bufferView": sparse_indices, "componentType": 5121 },
        "values": { "bufferView": sparse_values },
    });
    let moved_normal = b.floats("VEC3", &[0.0; 12]);
    let attributes = json!({
        "POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv_0, "TEXCOORD_1": uv_1,
        "COLOR_0": color, "JOINTS_0": joints, "WEIGHTS_0": weights,
    });
    let skinned = json!({
        "attributes": attributes, "indices": indices, "mode": 5, "material": 0,
        "targets": [{ "POSITION": moved, "NORMAL": moved_normal }, { "POSITION": moved }],
    });
    b.push("meshes", json!({ "name": "skinned", "primitives": [skinned], "weights": [0.5, 0.0] }));
    let flat = json!({ "attributes": { "POSITION": position, "TEXCOORD_0": uv_0 }, "indices": indices, "mode": 6, "material": 1 });
    b.push("meshes", json!({ "name": "flat", "primitives": [flat] }));

    let image = b.view(&png(2, 2));
    b.push("images", json!({ "bufferView": image, "mimeType": "image/png" }));
    b.push("samplers", json!({ "wrapS": 33071, "wrapT": 33648, "magFilter": 9728, "minFilter": 9985 }));
    b.push("textures", json!({ "source": 0, "sampler": 0 }));
    let transform = json!({ "KHR_texture_transform": { "offset": [0.1, 0.2], "rotation": 0.3, "scale": [2, 3] } });
    b.push("materials", json!({
        "name": "full",
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.5, 0.5, 0.5, 1], "baseColorTexture": { "index": 0, "extensions": transform },
            "metallicFactor": 0.5, "roughnessFactor": 0.5, "metallicRoughnessTexture": { "index": 0, "texCoord": 1 },
        },
        "normalTexture": { "index": 0, "scale": 0.5 },
        "occlusionTexture": { "index": 0, "strength": 0.5 },
        "emissiveTexture": { "index": 0 }, "emissiveFactor": [1, 1, 1],
        "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 3 } },
        "alphaMode": "MASK", "alphaCutoff": 0.25, "doubleSided": true,
    }));
    b.push("materials", json!({ "normalTexture": { "index": 0 } }));

    let inverse_bind = b.floats("MAT4", &[1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.].repeat(2));
    b.push("skins", json!({ "joints": [2, 3], "inverseBindMatrices": inverse_bind }));
    b.push("cameras", json!({ "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1 } }));
    let orthographic = json!({ "xmag": 1, "ymag": 1, "znear": 0, "zfar": 10 });
    b.push("cameras", json!({ "type": "orthographic", "orthographic": orthographic }));
    b.json["extensions"]["KHR_lights_punctual"]["lights"] = json!([
        { "type": "point", "range": 5 },
        { "type": "spot", "spot": { "innerConeAngle": 0.1, "outerConeAngle": 0.5 }, "color": [1, 0.5, 0.25] },
        { "type": "directional", "intensity": 2 },
    ]);
    let light = |light: usize| json!({ "KHR_lights_punctual": { "light": light } });
    let matrix = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 1., 2., 3., 1.];
    b.json["nodes"] = json!([
        { "name": "root", "children": [1, 4, 5, 6, 7] },
        { "mesh": 0, "skin": 0, "weights": [0.25, 0.5] },
        { "children": [3], "translation": [0, 1, 0], "rotation": [0, 0, 1, 0], "scale": [1, 2, 1] },
        {},
        { "mesh": 1, "matrix": matrix },
        { "camera": 0, "extensions": light(0) },
        { "camera": 1, "extensions": light(1) },
        { "extensions": light(2) },
    ]);
    b.json["scenes"] = json!([{ "name": "one", "nodes": [0] }, { "name": "two", "nodes": [2] }]);
    b.json["scene"] = json!(0);

    let times = b.floats("SCALAR", &[0.0, 1.0]);
    let moves = b.floats("VEC3", &[0.0; 18]);
    let turns = b.u16s("VEC4", &[0, 0, 0, 65535, 65535, 0, 0, 0]);
    b.json["accessors"][turns]["normalized"] = json!(true);
    let scales = b.floats("VEC3", &[1.0; 6]);
    let changes = b.floats("SCALAR", &[0.0, 1.0, 1.0, 0.0]);
    b.push(
        "animations",
        json!({
            "samplers": [
                { "input": times, "output": moves, "interpolation": "CUBICSPLINE" },
                { "input": times, "output": turns },
                { "input": times, "output": scales, "interpolation": "STEP" },
                { "input": times, "output": changes },
            ],
            "channels": [
                { "sampler": 0, "target": { "node": 3, "path": "translation" } },
                { "sampler": 1, "target": { "node": 3, "path": "rotation" } },
                { "sampler": 2, "target": { "node": 2, "path": "scale" } },
                { "sampler": 3, "target": { "node": 1, "path": "weights" } },
            ],
        }),
    );
    b.json["buffers"] = json!([{ "byteLength": b.binary.len() }]);
    b
}

/// A grey PNG.
pub fn png(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let image = image::RgbaImage::from_pixel(width, height, image::Rgba([128, 128, 255, 255]));
    image.write_to(&mut bytes, image::ImageFormat::Png).expect("memory to write to");
    bytes.into_inner()
}

/// What came of loading a file, in one line: `accept`, `note: ...` with all notes, or `reject POINTER: RULE`.
pub fn verdict(result: &Result<Scene, SceneError>) -> String {
    match result.as_ref().map_err(|error| &error.fault) {
        Ok(scene) if scene.notes.is_empty() => "accept".into(),
        Ok(scene) => {
            // Files of a scene are told apart by their names, wherever the scene is.
            let notes = scene.notes.join(" | ").replace(['\t', '\n'], " ");
            let parts = notes
                .split('"')
                .map(|part| if part.starts_with('/') { part.rsplit('/').next().unwrap_or(part) } else { part });
            format!("note: {}", parts.collect::<Vec<_>>().join("\""))
        }
        Err(fault) => format!("reject {}", rule(fault)),
    }
}

/// Where and by which rule a file is refused, without the value seen and without advice.
pub fn rule(fault: &Fault) -> String {
    match fault {
        Fault::Invalid { pointer, rule, .. } | Fault::TooLarge { pointer, rule, .. } => format!("{pointer}: {rule}"),
        Fault::RefusedUri { pointer, rule, .. } => format!("{pointer}: {rule}"),
        Fault::RequiredExtension { pointer, names, .. } => format!("{pointer}: {names}"),
        Fault::Container { rule, .. } => format!("the .glb container: {rule}"),
        Fault::Json { .. } => "the JSON: it cannot be parsed".into(),
        Fault::Version { seen } => format!("the version: {seen}"),
        Fault::Unreadable { what, .. } => format!("{}: cannot be read", what.rsplit('/').next().unwrap_or(what)),
        other => other.to_string(),
    }
}

/// Adds nodes for every mesh (with every material), camera, light and skin, and makes one scene of all root nodes. What
/// no mesh or material uses is given one: accessors, or else buffer views, or else buffers; textures, or else images.
pub fn show_everything(document: &mut Value) {
    let count = |list: &Value| list.as_array().map_or(0, Vec::len);
    use_everything(document);
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

/// Meshes and materials of what nothing uses.
fn use_everything(document: &mut Value) {
    let count = |list: &Value| list.as_array().map_or(0, Vec::len);
    let names = ["meshes", "accessors", "bufferViews", "buffers", "materials", "textures", "images", "samplers"];
    let [meshes, mut accessors, mut views, buffers, materials, mut textures, images, samplers] =
        names.map(|name| count(&document[name]));
    let kind = |accessor: &Value| accessor["type"].as_str().unwrap_or_default().to_owned();
    let kinds: Vec<String> = document["accessors"].as_array().into_iter().flatten().map(kind).collect();
    let Some(root) = document.as_object_mut() else { return };
    let is_moving = ["animations", "skins"].iter().any(|name| root.contains_key(*name));
    let mut push = |list: &str, value: Value| {
        if let Some(list) = root.entry(list).or_insert_with(|| json!([])).as_array_mut() {
            list.push(value);
        }
    };
    if meshes == 0 && !is_moving {
        if accessors == 0 && views == 0 {
            (0..buffers).for_each(|buffer| push("bufferViews", json!({ "buffer": buffer, "byteLength": 36 })));
            views = buffers;
        }
        if accessors == 0 {
            let accessor =
                |view: usize| json!({ "bufferView": view, "componentType": 5126, "type": "VEC3", "count": 3 });
            (0..views).for_each(|view| push("accessors", accessor(view)));
            accessors = views;
        }
        // Of other shapes than positions have, nothing would be looked at but that.
        let others = ["SCALAR", "VEC2", "VEC4", "MAT2", "MAT3", "MAT4"];
        for accessor in
            (0..accessors).filter(|index| kinds.get(*index).is_none_or(|kind| !others.contains(&kind.as_str())))
        {
            let primitive = json!({ "attributes": { "POSITION": accessor } });
            push("meshes", json!({ "primitives": [primitive] }));
        }
    }
    if materials == 0 {
        if textures == 0 {
            (0..images).for_each(|image| push("textures", json!({ "source": image })));
            (0..samplers).for_each(|sampler| push("textures", json!({ "sampler": sampler })));
            textures = images + samplers;
        }
        for texture in 0..textures {
            push("materials", json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": texture } } }));
        }
    }
}
