//! `linklight leak` and `linklight lag` as black boxes.

use std::process::{Command, Output, Stdio};

use serde_json::Value;

fn linklight(arguments: &[&str]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_linklight"));
    let output = program.env_remove("RUST_LOG").stdin(Stdio::null()).args(arguments).output().unwrap();
    assert!(!String::from_utf8_lossy(&output.stderr).contains("panicked"), "{output:?}");
    output
}

const SMALL: [&str; 9] = ["--", "--size", "32x24", "--elements", "900", "--bounces", "1", "--spp", "2"];

/// Through a wall nothing comes along rays; what comes through a thin one otherwise fails the limit that was set.
#[test]
fn light_through_walls_is_measured() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("leak.json");
    let of = ["leak", "-o", file.to_str().unwrap(), "--walls", "0,100", "--sides", "two", "--fail-above", "0.000001"];
    let exact = linklight(&[&of[..], &["--method", "path-tracing"], &SMALL].concat());
    assert!(exact.status.success(), "{}", String::from_utf8_lossy(&exact.stderr));
    let report: Value = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
    assert_eq!((&report["schema"], &report["version"]), (&"linklight-leak".into(), &1.into()));
    let rows = report["rows"].as_array().unwrap();
    assert_eq!(rows.iter().map(|row| row["wall_mm"].as_u64().unwrap()).collect::<Vec<_>>(), [0, 100]);
    for row in rows {
        assert_eq!(row["leak"], 0.0, "{row}");
        assert!(row["lit"].as_f64().unwrap() > 0.1, "{row}");
    }
    let leaky = linklight(&[&of[..], &["--method", "antiradiance", "--set", "bins=72"], &SMALL].concat());
    assert_eq!(leaky.status.code(), Some(1));
    let message = String::from_utf8_lossy(&leaky.stderr).into_owned();
    assert!(message.contains("closed-rooms?wall=0") && message.contains("comes through"), "{message}");
}

#[test]
fn a_change_of_the_lights_is_seen_in_the_next_frame() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("lag.json");
    let of = ["lag", "builtin:maze", "-o", file.to_str().unwrap(), "--frames", "3"];
    let output =
        linklight(&[&of[..], &["--method", "explicit-visibility", "--method", "path-tracing"], &SMALL].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let report: Value = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
    for row in report["rows"].as_array().unwrap() {
        assert_eq!(row["frames"], 1, "{row}");
        assert!(row["ms"].as_f64().unwrap() > 0.0);
    }
    let dark = linklight(&[&["lag", "builtin:furnace", "--method", "path-tracing"][..], &SMALL].concat());
    assert_eq!(dark.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&dark.stderr).contains("no punctual light"));
}
