//! The shared collection of bad files: the negative tests of the Khronos validator and of the asset generator, and
//! files that need what we lack. `verdicts.tsv` says for each what must come of it, as it stands and with everything in
//! it put into a scene: accepted, accepted with these notes, or rejected at this JSON pointer by this rule.
//!
//! The rules themselves are tested without the collection in `bad.rs` and `rules.rs`.

use crate::sound::assert_sound;
use crate::support::{gltf_files, shared, show_everything, verdict};
use linklight::scene::gltf::Fault;
use linklight::scene::{self, LoadOptions, Scene, SceneError};
use serde_json::Value;
use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use std::time::{Duration, Instant};

/// File, verdict as it stands, verdict with everything shown (`=` where it is the same, `-` where it has no JSON).
const VERDICTS: &str = include_str!("verdicts.tsv");

/// No file of the collection needs more than a few milliseconds; the slowest machine gets a hundred times that.
const MAX_TIME: Duration = Duration::from_secs(5);

/// Loads within bounds; a scene must keep its promises, an error must say where or which rule, and what to do.
fn load(path: &Path, name: &str) -> Result<Scene, SceneError> {
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

/// What comes of a file, as it stands and with everything shown.
fn verdicts_of(file: &Path, name: &str, copy: &Path) -> [String; 2] {
    let whole = verdict(&load(file, name));
    let parsed = std::fs::read(file).ok().and_then(|bytes| serde_json::from_slice::<Value>(&bytes).ok());
    let Some(mut document) = parsed.filter(Value::is_object) else { return [whole, "-".into()] };
    show_everything(&mut document);
    std::fs::create_dir(copy).unwrap();
    for entry in std::fs::read_dir(file.parent().unwrap()).unwrap() {
        let path = entry.unwrap().path();
        if path.is_file() && path.extension().is_none_or(|extension| extension != "gltf" && extension != "glb") {
            std::fs::copy(&path, copy.join(path.file_name().unwrap())).unwrap();
        }
    }
    let path = copy.join("scene.gltf");
    std::fs::write(&path, document.to_string()).unwrap();
    let shown = verdict(&load(&path, name));
    let shown = if shown == whole { "=".into() } else { shown };
    [whole, shown]
}

/// Rows of a tab-separated table by their first cell.
fn rows(text: &str) -> BTreeMap<&str, Vec<&str>> {
    text.lines().map(|row| row.split('\t').collect()).map(|cells: Vec<&str>| (cells[0], cells)).collect()
}

/// Where the table and what came of the files part, one line each.
fn differences(table: &str, found: &BTreeMap<String, [String; 2]>) -> Vec<String> {
    let rows = rows(table);
    let mut wrong = Vec::new();
    for (name, [whole, shown]) in found {
        match rows.get(name.as_str()) {
            Some(row) if row[1..] == [whole, shown] => {}
            row => wrong.push(format!("{row:?}, found {:?}", [name, whole, shown])),
        }
    }
    wrong.extend(rows.keys().filter(|name| !found.contains_key(**name)).map(|name| format!("{name} is not there")));
    wrong
}

#[test]
fn every_shared_file_meets_its_verdict() {
    let Some(folder) = shared("bad-gltf") else { return };
    let copies = tempfile::tempdir().unwrap();
    let mut found = BTreeMap::new();
    for (number, file) in gltf_files(&folder).into_iter().enumerate() {
        let name = file.strip_prefix(&folder).unwrap().to_string_lossy().replace('\\', "/");
        let verdicts = verdicts_of(&file, &name, &copies.path().join(number.to_string()));
        found.insert(name, verdicts);
    }
    // To take over what changed on purpose, after reading every line of the difference.
    if let Some(path) = std::env::var_os("LINKLIGHT_WRITE_VERDICTS") {
        let text: String = found.iter().map(|(name, [whole, shown])| format!("{name}\t{whole}\t{shown}\n")).collect();
        std::fs::write(path, text).unwrap();
    }
    let wrong = differences(VERDICTS, &found);
    assert!(wrong.is_empty(), "{} of {} files:\n{}", wrong.len(), found.len(), wrong.join("\n"));
    // All three happen a lot; were all refused or all accepted, this would look at nothing.
    let is = |verdict: &String, start: &str| verdict.starts_with(start);
    let count = |start: &str| found.values().filter(|[whole, shown]| is(whole, start) || is(shown, start)).count();
    let counts = [count("accept"), count("note"), count("reject")];
    assert!(counts.iter().all(|count| *count > 20), "{counts:?}");
}

#[test]
fn a_wrong_verdict_is_seen() {
    let found = BTreeMap::from([("a.gltf".to_owned(), ["accept".to_owned(), "=".to_owned()])]);
    assert_eq!(differences("a.gltf\taccept\t=\n", &found), Vec::<String>::new());
    for wrong in ["", "a.gltf\treject\t=\n", "a.gltf\taccept\t-\n", "a.gltf\taccept\t=\nb.gltf\taccept\t=\n"] {
        assert_eq!(differences(wrong, &found).len(), 1, "{wrong:?}");
    }
}

/// Rows of a manifest of the collection by file name.
fn manifest(folder: &Path) -> HashMap<String, Vec<String>> {
    let text = std::fs::read_to_string(folder.join("MANIFEST.tsv")).unwrap();
    let cells = |row: &str| row.split('\t').map(str::to_owned).collect::<Vec<_>>();
    text.lines().skip(1).map(cells).map(|cells| (cells[0].clone(), cells)).collect()
}

/// The table is ours; the validator's own report holds it to the specification.
#[test]
fn the_verdicts_agree_with_the_validator() {
    let Some(folder) = shared("bad-gltf/validator") else { return };
    let verdicts = rows(VERDICTS);
    let mut checked = 0;
    for (name, row) in manifest(&folder) {
        let verdict = verdicts[format!("validator/{name}").as_str()][1];
        let is_excepted = [
            // A minimum version above 2.0 passes with a warning, and readers of 2.0 must refuse it (glTF 2.0, 3.2).
            "base/data/asset/min_version_valid.gltf",
            // Their shapes are in buffers that have no data, which the schema allows.
            "base/data/root/named_objects.gltf",
            "base/data/root/unused_objects.gltf",
        ]
        .contains(&name.as_str());
        if row[1] == "0" {
            assert_eq!(verdict.starts_with("reject"), is_excepted, "{name}: {verdict}");
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
            assert!(verdict.starts_with("reject"), "{name}: {}, {verdict}", row[3]);
        }
        if row[3].split(',').any(|code| code == "INVALID_JSON") && !name.contains("bom") {
            let seen = verdict.starts_with("reject the JSON") || verdict.starts_with("reject the .glb container");
            assert!(seen, "{name}: {verdict}");
        }
        checked += 1;
    }
    assert!(checked > 300, "{checked} rows");
}

#[test]
fn what_needs_more_than_we_have_is_refused_by_name() {
    let Some(folder) = shared("bad-gltf/unsupported") else { return };
    let verdicts = rows(VERDICTS);
    for (name, row) in manifest(&folder) {
        let verdict = verdicts[format!("unsupported/{name}").as_str()][1];
        let what = &row[1];
        let expected: &[&str] = match name.as_str() {
            // Listed as valid with quantisation alone, but its compression is required too.
            "mesh_quantization.glb" => &["reject /extensionsRequired", "EXT_meshopt_compression"],
            "UnsupportedRequiredExtensions.gltf" => &["EXT_lights_image_based", "KHR_xmp"],
            _ if what.contains("glTF 1.0") => &["reject the version"],
            _ if what.contains("meshopt") => &["reject /extensionsRequired", "EXT_meshopt_compression"],
            _ if what.contains("webp") => &["KHR_draco_mesh_compression", "EXT_texture_webp"],
            _ if what.to_lowercase().contains("draco") => &["KHR_draco_mesh_compression"],
            _ if what.contains("VALID") => &["accept"],
            other => panic!("{other}: {what}"),
        };
        expected.iter().for_each(|part| assert!(verdict.contains(part), "{name}: {verdict}"));
    }
}
