//! A GPU that is lost: the command ends at once with a typed error and leaves a file that says where it was.
//!
//! No driver can be made to lose its device on demand, so `--lose-device-at` ends the submission before the named pass:
//! the device's markers stand as they do when a driver gives up there. That work which does not end in time is left
//! alone is shown with real work and too little time.

use std::path::Path;
use std::process::{Command, Output};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use serde_json::Value;

const SCENE: &str = "render builtin:cornell-box --size 24x16 --elements 300 --bounces 2 --spp 2 -o picture.exr";

fn linklight(folder: &Path, options: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_linklight"));
    command.current_dir(folder).args(options.split_whitespace()).output().unwrap()
}

fn crash(folder: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(folder.join("crash.json")).unwrap()).unwrap()
}

/// Whether a crash file tells of a loss in `pass`: it began, it did not end, and something before it did.
fn tells_of(crash: &Value, pass: &str) -> bool {
    let queue = &crash["queues"][0];
    let ends = |value: &Value| value.as_str().is_some_and(|path| path.ends_with(pass));
    let is_running = queue["running"].as_array().is_some_and(|running| running.iter().any(ends));
    is_running && ends(&queue["begun"]) && queue["ended"].as_str() != queue["begun"].as_str()
}

fn since(unix_ms: u64) -> Duration {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap();
    now.saturating_sub(Duration::from_millis(unix_ms))
}

#[test]
fn a_lost_gpu_ends_every_method_with_the_pass_it_had_come_to() {
    for (method, pass, scope) in [
        ("explicit-visibility", "gather/links@2", "bounce 2"),
        ("implicit-visibility", "methods/implicit_visibility/resolve", "implicit-visibility"),
        ("antiradiance", "methods/antiradiance/local_exitant", "antiradiance"),
        ("surface-shadow-maps --set keep_maps=false --set atlas_resolution=16", "display/direct", "frame"),
        ("face-cluster", "display/irradiance_vector", "frame"),
        ("path-tracing", "methods/path_tracing/scatter", "path-tracing"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let options = format!("{SCENE} --method {method} --lose-device-at {pass} --crash-file crash.json --validate");
        let output = linklight(folder.path(), &options);
        let took = since(crash(folder.path())["unix_ms"].as_u64().unwrap());
        assert!(took < Duration::from_secs(2), "{method} took {took:?} to end");
        let said = String::from_utf8_lossy(&output.stderr);
        let pass = pass.split('@').next().unwrap();
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(
            said.contains("the device was lost in") && said.contains(pass) && said.contains("crash.json"),
            "{said}"
        );
        assert!(!said.contains("validation"), "{said}");

        let crash = crash(folder.path());
        assert!(tells_of(&crash, pass), "{method}: {crash:#}");
        let begun = crash["queues"][0]["begun"].as_str().unwrap();
        assert!(begun.contains(scope), "{method}: {begun}");
        assert!(crash["is_provoked"] == true && crash["device"]["driver"].is_string(), "{crash:#}");
        assert_eq!(crash["settings"]["method"], method.split(' ').next().unwrap());
        // The command, and the check itself.
        let command = crash["command"].as_str().unwrap();
        assert!(command.starts_with("linklight render builtin:cornell-box") && !command.contains("lose"), "{command}");
        assert!(!tells_of(&crash, "gather/nothing"));
        let mut ended = crash.clone();
        ended["queues"][0]["ended"] = ended["queues"][0]["begun"].clone();
        assert!(!tells_of(&ended, pass), "a pass that ended is not where it was lost");

        let files: Vec<_> = std::fs::read_dir(folder.path()).unwrap().flatten().map(|e| e.file_name()).collect();
        assert_eq!(files, ["crash.json"], "{method}: no picture, whole or half");
    }
}

#[test]
fn work_that_does_not_end_in_time_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let scene = "render builtin:cornell-box --size 640x480 --method path-tracing --spp 4 -o picture.exr";
    let start = Instant::now();
    let output = linklight(folder.path(), &format!("{scene} --gpu-timeout 0.02 --crash-file crash.json"));
    let (whole, crash) = (start.elapsed(), crash(folder.path()));
    let took = since(crash["unix_ms"].as_u64().unwrap());
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("did not finish") && said.contains("0.02 s") && said.contains("--gpu-timeout"), "{said}");
    assert!(took < Duration::from_secs(2), "{took:?} of {whole:?} after the loss was known");
    assert!(crash["is_provoked"] == false && crash["queues"][0]["passes"].as_u64() > Some(0), "{crash:#}");
}

#[test]
fn what_cannot_be_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (option, word) in [
        ("--gpu-timeout 0", "seconds above 0"),
        ("--gpu-timeout never", "seconds above 0"),
        ("--lose-device-at links", "gather/links"),
        ("--lose-device-at gather/links@0", "third run"),
    ] {
        let output = linklight(folder.path(), &format!("{SCENE} {option}"));
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && said.contains(word), "{option}: {said}");
    }
    // A pass that never runs loses nothing.
    let output = linklight(folder.path(), &format!("{SCENE} --lose-device-at no/pass --quiet"));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
