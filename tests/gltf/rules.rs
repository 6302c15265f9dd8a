//! Every rule that the loader holds files to: one break each, in a file that uses everything, and the message that names the
//! JSON pointer and the rule. The rules are read from the loader's own sources, so that none is left out.

use crate::support::everything;
use linklight::scene;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::Path;

/// What comes of a break.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Verdict {
    Refused,
    /// The scene is shown without the part; a note says so.
    Noted,
}
use Verdict::{Noted, Refused};

/// Where the file is changed, to what (null takes it out), what comes of it, and the pointer and rule in the message.
type Break = (&'static str, Value, Verdict, &'static str, &'static str);

/// The file as it is shown in `support.rs`: accessors by order of making (7 indices, 8 sparse, 10 inverse bind matrices, 11
/// times, 12 to 15 outputs), buffer views likewise (12 the image).
fn breaks() -> Vec<Break> {
    vec![
        // The root and what every object is read by.
        ("/asset", json!(null), Refused, "/asset", "is required"),
        ("/asset", json!(3), Refused, "/asset", "must be an object"),
        ("/asset/version", json!("two"), Refused, "/asset/version", "must be of the form major.minor"),
        (
            "/asset",
            json!({"version": "2.1", "minVersion": "x"}),
            Refused,
            "/asset/minVersion",
            "must be of the form major.minor",
        ),
        ("/nodes", json!({}), Refused, "/nodes", "must be an array"),
        ("/asset/version", json!(2.0), Refused, "/asset/version", "must be a string"),
        ("/materials/0/doubleSided", json!(1), Refused, "/materials/0/doubleSided", "must be true or false"),
        ("/scene", json!(-1), Refused, "/scene", "must be a non-negative integer"),
        ("/scene", json!(2), Refused, "/scene", "must refer to one of the file's 2 scenes (0 to 1)"),
        ("/nodes/5/camera", json!(9), Refused, "/nodes/5/camera", "must refer to one of the file's 2 cameras"),
        ("/nodes/2/translation", json!([0, 1]), Refused, "/nodes/2/translation", "must hold 3 numbers"),
        ("/nodes/2/scale/1", json!("1"), Refused, "/nodes/2/scale/1", "must be a number that a 32-bit float can hold"),
        ("/nodes/2/scale/1", json!(1e39), Refused, "/nodes/2/scale/1", "must be a number that a 32-bit float can hold"),
        // Buffers and their views.
        ("/buffers/0/byteLength", json!(1u64 << 40), Refused, "/buffers/0/byteLength", "must not be more than the"),
        (
            "/buffers/0/uri",
            json!("data:text/plain,abc"),
            Refused,
            "/buffers/0/uri",
            "must be a data URI with base64 data",
        ),
        ("/buffers/0/uri", json!("data:;base64,*"), Refused, "/buffers/0/uri", "must be a data URI with base64 data"),
        (
            "/bufferViews/0/byteStride",
            json!(13),
            Refused,
            "/bufferViews/0/byteStride",
            "must be a multiple of 4 from 4 to 252",
        ),
        ("/bufferViews/0/byteLength", json!(0), Refused, "/bufferViews/0/byteLength", "must be at least 1"),
        ("/bufferViews/0/byteOffset", json!(1u64 << 40), Refused, "/bufferViews/0", "must end within the"),
        // Accessors.
        ("/accessors/0/count", json!(0), Refused, "/accessors/0/count", "must be from 1 to 4294967295"),
        ("/accessors/0/type", json!("VEC5"), Refused, "/accessors/0/type", "must be one of"),
        ("/accessors/0/componentType", json!(5124), Refused, "/accessors/0/componentType", "must be one of"),
        ("/accessors/0/type", json!("SCALAR"), Refused, "/accessors/0", "must be VEC3 of"),
        ("/accessors/1/count", json!(3), Refused, "/accessors/1/count", "must have 4 elements"),
        ("/accessors/0/byteOffset", json!(2), Refused, "/accessors/0/byteOffset", "be a multiple of 4"),
        ("/accessors/0/count", json!(400), Refused, "/accessors/0", "must end within the"),
        ("/bufferViews/0/byteStride", json!(4), Refused, "/accessors/0", "must cover its elements of 12 bytes"),
        (
            "/accessors/8/sparse/count",
            json!(9),
            Refused,
            "/accessors/8/sparse/count",
            "must be from 1 to the accessor's 4 elements",
        ),
        ("/accessors/8/sparse/indices", json!(null), Refused, "/accessors/8/sparse/indices", "is required"),
        (
            "/bufferViews/9/byteOffset",
            json!(0),
            Refused,
            "/accessors/8/sparse/indices",
            "must increase strictly and stay below 4",
        ),
        // Meshes.
        ("/meshes/1/primitives", json!([]), Refused, "/meshes/1/primitives", "must hold at least one primitive"),
        (
            "/meshes/0/primitives/1",
            json!({"attributes": {"POSITION": 0}}),
            Refused,
            "/meshes/0/primitives/1/targets",
            "must hold as many morph targets as the mesh's first primitive, 2",
        ),
        (
            "/meshes/0/weights",
            json!([1]),
            Refused,
            "/meshes/0/weights",
            "must hold a weight for each of the 2 morph targets",
        ),
        ("/meshes/0/primitives/0/mode", json!(7), Refused, "/meshes/0/primitives/0/mode", "must be from 0 to 6"),
        ("/meshes/0/primitives/0/attributes", json!(null), Refused, "/meshes/0/primitives/0/attributes", "is required"),
        ("/meshes/1/primitives/0/indices", json!(0), Refused, "/accessors/0", "must be SCALAR of"),
        ("/materials/0/alphaMode", json!("GLASS"), Refused, "/materials/0/alphaMode", "must be OPAQUE, MASK or BLEND"),
        // Nodes.
        ("/nodes/2/children/0", json!(1), Refused, "/nodes/2/children/0", "must name a node that has no other parent"),
        ("/scenes/0/nodes/0", json!(1), Refused, "/scenes/0/nodes/0", "must name a node without parent"),
        ("/scenes/0/nodes", json!([0, 0]), Refused, "/scenes/0/nodes/1", "must not name a node twice"),
        ("/nodes/4/matrix/3", json!(1), Refused, "/nodes/4/matrix", "must be affine, its last row 0 0 0 1"),
        (
            "/nodes/1/weights",
            json!([1]),
            Refused,
            "/nodes/1/weights",
            "must hold a weight for each of the mesh's 2 morph targets",
        ),
        // Skins.
        ("/skins/0/joints", json!([]), Refused, "/skins/0/joints", "must name at least one node"),
        ("/skins/0/joints/1", json!(99), Refused, "/skins/0/joints/1", "must refer to one of the file's 8 nodes"),
        ("/accessors/10/count", json!(1), Refused, "/accessors/10/count", "must cover the 2 joints of /skins/0"),
        ("/skins/0/joints", json!([2]), Refused, "/nodes/1/skin", "must have a joint for each that its mesh names"),
        // Cameras, without which a scene can be shown.
        ("/cameras/0/type", json!("fisheye"), Noted, "/cameras/0/type", "must be perspective or orthographic"),
        ("/cameras/0/perspective/yfov", json!(3.2), Noted, "/cameras/0/perspective/yfov", "must be between 0 and pi"),
        ("/cameras/0/perspective/znear", json!(0), Noted, "/cameras/0/perspective/znear", "must be positive"),
        ("/cameras/0/perspective/zfar", json!(0.05), Noted, "/cameras/0/perspective/zfar", "must be beyond znear"),
        ("/cameras/1/orthographic/xmag", json!(0), Noted, "/cameras/1/orthographic/xmag", "must be positive"),
        ("/cameras/1/orthographic/znear", json!(-1), Noted, "/cameras/1/orthographic/znear", "must not be negative"),
        // Images.
        ("/images/0/uri", json!("a.png"), Noted, "/images/0", "must have either uri or bufferView"),
        ("/bufferViews/12/byteOffset", json!(0), Noted, "/images/0", "must be a PNG or a JPEG"),
        ("/bufferViews/12/byteLength", json!(30), Noted, "/images/0", "must be a readable PNG or JPEG"),
        // Animations, without which a scene can be shown.
        (
            "/animations/0/samplers/0/interpolation",
            json!("CUBIC"),
            Noted,
            "/animations/0/samplers/0/interpolation",
            "must be STEP, LINEAR or CUBICSPLINE",
        ),
        ("/animations/0/samplers/0/input", json!(null), Noted, "/animations/0/samplers/0/input", "is required"),
        (
            "/animations/0/channels/0/target/path",
            json!("colour"),
            Noted,
            "/animations/0/channels/0/target/path",
            "must be translation, rotation, scale or weights",
        ),
        (
            "/animations/0/channels/3/target/node",
            json!(3),
            Noted,
            "/animations/0/channels/3/target/node",
            "must name a node with morph targets where the path is weights",
        ),
        (
            "/animations/0/channels/1/target",
            json!({"node": 3, "path": "translation"}),
            Noted,
            "/animations/0/channels/1/target/path",
            "must not be one that another channel of the animation moves already",
        ),
        ("/accessors/14/count", json!(1), Noted, "/accessors/14/count", "must hold 2 values for the 2 keys"),
        ("/accessors/11/byteOffset", json!(4), Noted, "/accessors/11", "must end within the"),
    ]
}

/// `file` with the value at `pointer` replaced, put in, or taken out where it is null.
fn bend(file: &mut Value, pointer: &str, value: &Value) {
    let (parent, key) = pointer.rsplit_once('/').unwrap();
    let parent = file.pointer_mut(parent).unwrap_or_else(|| panic!("{pointer} is not in the file"));
    match parent {
        Value::Object(map) if value.is_null() => {
            map.remove(key).unwrap_or_else(|| panic!("{pointer} is not in the file"));
        }
        Value::Object(map) => drop(map.insert(key.to_owned(), value.clone())),
        Value::Array(list) => {
            let at: usize = key.parse().unwrap();
            if at == list.len() {
                list.push(value.clone());
            } else {
                list[at] = value.clone();
            }
        }
        other => panic!("{pointer}: {other}"),
    }
}

/// What comes of the file with this break, in words.
fn outcome(pointer: &str, value: &Value) -> (Verdict, String) {
    let mut builder = everything();
    bend(&mut builder.json, pointer, value);
    match scene::load_bytes("test.glb", &builder.glb()) {
        Ok(scene) => (Noted, scene.notes.join("\n")),
        Err(error) => (Refused, error.fault.to_string()),
    }
}

#[test]
fn every_break_is_told_by_pointer_and_rule() {
    let whole = scene::load_bytes("test.glb", &everything().glb()).unwrap();
    assert_eq!(whole.notes, [""; 0], "the file is sound before");
    let mut wrong = Vec::new();
    for (at, value, verdict, pointer, rule) in breaks() {
        let (found, said) = outcome(at, &value);
        let told = if verdict == Refused { said.starts_with(&format!("{pointer}: ")) } else { said.contains(pointer) };
        if found != verdict || !told || !said.contains(rule) {
            wrong.push(format!("{at} = {value}: {found:?} {said:?}, expected {verdict:?} {pointer}: {rule}"));
        }
    }
    assert!(wrong.is_empty(), "{} breaks:\n{}", wrong.len(), wrong.join("\n"));
}

/// The beginnings of the rules in the loader's sources, as far as they are fixed words.
fn rules() -> BTreeSet<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/scene/gltf");
    let mut rules = BTreeSet::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        let own = text.split("#[cfg(test)]").next().unwrap();
        for line in own.lines().filter(|line| !line.trim_start().starts_with("//")) {
            for literal in line.split('"').skip(1).step_by(2).filter(|literal| literal.starts_with("must ")) {
                let fixed = literal.split('{').next().unwrap().trim_end();
                if fixed.len() > 5 {
                    rules.insert(fixed.to_owned());
                }
            }
        }
    }
    assert!(rules.len() > 30, "{rules:?}");
    rules
}

/// Rules that this file cannot break, and where they are.
const ELSEWHERE: [(&str, &str); 8] = [
    ("must hold finite numbers only", "bad.rs: values that are not finite"),
    ("must stay below the", "bad.rs: indices"),
    ("must not hold the value that restarts primitives", "verdicts.tsv"),
    ("must not be its own ancestor or hang below one that is", "bad.rs: node graphs"),
    ("must have less than", "more triangles than a test can hold"),
    ("must exist, since it is referred to", "indices are held to the list before"),
    ("must be a node of the scene", "mutated.rs: skins"),
    ("must be from 1 to", "bad.rs: images; counts above"),
];

#[test]
fn no_rule_of_the_loader_is_left_out() {
    let breaks = breaks();
    let is_broken = |rule: &&String| {
        breaks.iter().any(|(.., told)| told.contains(rule.as_str()) || rule.starts_with(told) && !told.is_empty())
            || ELSEWHERE.iter().any(|(start, _)| rule.starts_with(start))
    };
    let left: Vec<String> = rules().iter().filter(|rule| !is_broken(rule)).cloned().collect();
    assert!(left.is_empty(), "rules without a break: {left:#?}");
}
