//! A file that uses every feature, bent in one to three places at a time: whatever comes out, nothing panics, runs on
//! or breaks what a loaded scene promises.

use crate::sound::assert_sound;
use crate::support::{everything, glb};
use linklight::scene::{self, LoadOptions};
use proptest::prelude::*;
use serde_json::{Value, json};
use std::time::{Duration, Instant};

/// Every pointer into a document.
fn pointers(value: &Value, at: String, found: &mut Vec<String>) {
    match value {
        Value::Array(values) => {
            values.iter().enumerate().for_each(|(index, value)| pointers(value, format!("{at}/{index}"), found));
        }
        Value::Object(map) => map.iter().for_each(|(key, value)| pointers(value, format!("{at}/{key}"), found)),
        _ => {}
    }
    found.push(at);
}

/// What a value is replaced by: numbers at the edges of their types, other types, nothing.
fn hostile() -> impl Strategy<Value = Value> {
    prop_oneof![
        prop::sample::select(vec![
            json!(0),
            json!(1),
            json!(2),
            json!(3),
            json!(4),
            json!(5),
            json!(8),
            json!(16),
            json!(-1),
            json!(0.5),
            json!(255),
            json!(256),
            json!(65535),
            json!(5121),
            json!(5122),
            json!(5123),
            json!(5125),
            json!(5126),
            json!(1u64 << 31),
            json!(u32::MAX),
            json!(1u64 << 32),
            json!(i64::MAX),
            json!(u64::MAX),
            json!(1e-30),
            json!(1e30),
            json!(-1e30),
            json!(1e300),
            json!(null),
            json!(true),
            json!([]),
            json!({}),
            json!(""),
            json!("SCALAR"),
            json!("VEC2"),
            json!("VEC4"),
            json!("MAT4"),
            json!("CUBICSPLINE"),
            json!("STEP"),
            json!("weights"),
            json!("scale"),
            json!("data:;base64,AAAA"),
            json!("../a"),
            json!([0]),
            json!([0, 0, 0]),
            json!([0, 0, 0, 0]),
            json!([1, 1]),
            json!([[[]]]),
        ]),
        any::<u64>().prop_map(|number| json!(number)),
        (0u64..64).prop_map(|number| json!(number)),
    ]
}

/// Loads within bounds, whatever the outcome.
fn check(bytes: &[u8]) {
    let options = LoadOptions { max_memory_bytes: 64 << 20, scene: None };
    let start = Instant::now();
    match scene::load_bytes_with("test.glb", bytes, &options) {
        Ok(scene) => assert_sound(&scene, "a mutated file"),
        Err(error) => assert!(error.to_string().len() < 800, "{error}"),
    }
    assert!(start.elapsed() < Duration::from_secs(10), "{:?}", start.elapsed());
}

#[test]
fn the_file_to_be_bent_loads_whole() {
    let scene = scene::load_bytes("test.glb", &everything().glb()).unwrap_or_else(|error| panic!("{error}"));
    assert_sound(&scene, "everything");
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    let counts = [scene.meshes.len(), scene.skins.len(), scene.clips.len(), scene.cameras.len(), scene.lights.len()];
    assert_eq!(counts, [2, 1, 1, 2, 3]);
    assert_eq!((scene.images.len(), scene.clips[0].channels.len()), (2, 4));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn bent_json_is_harmless(bends in prop::collection::vec((any::<prop::sample::Index>(), hostile()), 1..4)) {
        let mut builder = everything();
        for (index, value) in bends {
            let mut found = Vec::new();
            pointers(&builder.json, String::new(), &mut found);
            *builder.json.pointer_mut(&found[index.index(found.len())]).expect("a pointer just found") = value;
        }
        check(&builder.glb());
    }

    #[test]
    fn missing_members_are_harmless(index in any::<prop::sample::Index>()) {
        let mut builder = everything();
        let mut found = Vec::new();
        pointers(&builder.json, String::new(), &mut found);
        let pointer = &found[index.index(found.len())];
        if let Some((parent, key)) = pointer.rsplit_once('/') {
            match builder.json.pointer_mut(parent).expect("a parent") {
                Value::Object(map) => drop(map.remove(key)),
                Value::Array(values) => drop(values.remove(key.parse().expect("an index"))),
                _ => {}
            }
        }
        check(&builder.glb());
    }

    #[test]
    fn bent_bytes_are_harmless(bends in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8)) {
        let mut bytes = everything().glb();
        for (index, value) in bends {
            let at = index.index(bytes.len());
            bytes[at] = value;
        }
        check(&bytes);
    }

    #[test]
    fn bent_data_is_harmless(bends in prop::collection::vec((any::<prop::sample::Index>(), any::<u32>()), 1..64)) {
        let mut builder = everything();
        for (index, value) in bends {
            let at = index.index(builder.binary.len() - 4) & !3;
            builder.binary[at..at + 4].copy_from_slice(&value.to_le_bytes());
        }
        check(&builder.glb());
    }

    #[test]
    fn random_bytes_are_harmless(json in prop::collection::vec(any::<u8>(), 0..64), data in prop::collection::vec(any::<u8>(), 0..64)) {
        check(&json);
        check(&glb(&json, &data));
    }
}
