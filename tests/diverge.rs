//! `linklight render --hashes` and `linklight diverge` as black boxes.

use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;

fn linklight(arguments: &[&str]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_linklight"));
    let output = program.env_remove("RUST_LOG").stdin(Stdio::null()).args(arguments).output().unwrap();
    assert!(!String::from_utf8_lossy(&output.stderr).contains("panicked"), "{output:?}");
    output
}

/// Hashes of a small render; its picture.
#[track_caller]
fn hashes(folder: &Path, name: &str, options: &[&str]) -> (String, Vec<u8>) {
    let file = folder.join(format!("{name}.json")).to_str().unwrap().to_owned();
    let picture = folder.join(format!("{name}.exr"));
    let of = ["render", "builtin:cornell-box", "-o", picture.to_str().unwrap(), "--hashes", &file, "--validate"];
    let small = ["--size", "24x24", "--elements", "600", "--set", "rays_per_element=64"];
    let output = linklight(&[&of[..], &small, options].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    (file, std::fs::read(picture).unwrap())
}

fn divergence(a: &str, b: &str) -> Value {
    let output = linklight(&["diverge", a, b, "--json"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn the_first_pass_that_differs_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let (first, picture) = hashes(folder.path(), "first", &["--bounces", "2"]);
    let (second, _) = hashes(folder.path(), "second", &["--bounces", "2"]);
    assert_eq!(divergence(&first, &second), Value::Null, "the same run, the same bits");

    // Hashing changes nothing.
    let plain = folder.path().join("plain.exr");
    let of = ["render", "builtin:cornell-box", "-o", plain.to_str().unwrap(), "--size", "24x24", "--elements", "600"];
    assert!(linklight(&[&of[..], &["--bounces", "2", "--set", "rays_per_element=64"]].concat()).status.success());
    assert_eq!(std::fs::read(plain).unwrap(), picture);

    // Rays that start farther off their surface: placed there by the first pass that knows of elements.
    let (moved, _) = hashes(folder.path(), "moved", &["--bounces", "2", "--set", "ray_offset=0.001"]);
    let found = divergence(&first, &moved);
    assert!(found["path"].as_str().unwrap().ends_with("elements/place"), "{found}");
    assert_eq!(found["binding"], "ray_origins");
    assert!(found["what"]["content"]["blocks"].as_u64().unwrap() > 0, "{found}");

    // Another number of bounces is another list of passes.
    let (fewer, _) = hashes(folder.path(), "fewer", &["--bounces", "1"]);
    let output = linklight(&["diverge", &first, &fewer, "--fail"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stdout).contains("in its place"), "{output:?}");
}

#[test]
fn other_files_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.json");
    std::fs::write(&file, "{\"schema\": \"linklight-bench\"}").unwrap();
    let output = linklight(&["diverge", file.to_str().unwrap(), file.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("render --hashes"), "{output:?}");
}
