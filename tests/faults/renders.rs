//! Whole renders by each method, in which one Vulkan call or one access to a file fails.

use crate::{TURN, is_apart, sample};
use clap::Parser as _;
use linklight::app::{self, AppError, cli::Cli};
use linklight::files::{FileFaults, PLANTED};
use linklight::gpu::{Context, Failure, FaultInjection, Options};
use linklight::methods::{METHODS, Method};
use linklight::report::image;
use linklight::report::profile::Profile;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// A render takes well below a second, on a machine that does much else some more; one that waits for what never comes takes
/// ten minutes.
const MAX_TIME: Duration = Duration::from_secs(400);

fn render(method: &str, options: &[&str]) -> Result<(), AppError> {
    let small = ["--size", "12x8", "--bounces", "1", "--spp", "1", "--quiet"];
    let words = ["linklight", "render", "builtin:furnace", "--method", method].into_iter().chain(small);
    let cli = Cli::try_parse_from(words.chain(options.iter().copied())).unwrap_or_else(|error| panic!("{error}"));
    let start = Instant::now();
    let result = app::run(cli, &mut Vec::new());
    assert!(start.elapsed() < MAX_TIME, "{:?}", start.elapsed());
    result
}

fn pixels(path: &Path) -> Vec<glam::Vec3> {
    image::read(path).unwrap_or_else(|error| panic!("{error}")).rgb
}

/// Names of the files in a folder.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// All, or those that LINKLIGHT_FAULTS_METHODS names, separated by commas.
fn chosen_methods() -> impl Iterator<Item = &'static Method> {
    let wanted = std::env::var("LINKLIGHT_FAULTS_METHODS").ok();
    METHODS
        .iter()
        .filter(move |method| wanted.as_ref().is_none_or(|wanted| wanted.split(',').any(|name| name == method.key)))
}

/// Keeps the validation layer loaded while renders come and go: the C++ library within it takes a thread key of the process
/// each time that it is loaded, of which there are a thousand, and gives none back.
fn keep_layer() -> Context {
    Context::new(Options { validation: true, ..Options::default() }).unwrap()
}

/// Elements enough for a few, where the method takes a number.
fn elements(method: &str) -> &'static [&'static str] {
    match method {
        "surface-shadow-maps" => &["--set", "map_resolution=8"],
        "path-tracing" | "face-cluster" => &[],
        _ => &["--elements", "60"],
    }
}

#[test]
fn renders_survive_vulkan_calls_that_fail() {
    if !is_apart("renders::renders_survive_vulkan_calls_that_fail") {
        return;
    }
    let _turn = TURN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("out.exr");
    let path = output.to_str().unwrap();
    let _layer = keep_layer();
    let faults = FaultInjection::start();
    for method in chosen_methods() {
        let options = [&["--validate", "-o", path], elements(method.key)].concat();
        // Twice: the first fills the caches.
        render(method.key, &options).unwrap_or_else(|error| panic!("{}: {error}", method.key));
        faults.fail(0, Failure::OutOfHostMemory);
        render(method.key, &options).unwrap_or_else(|error| panic!("{}: {error}", method.key));
        let (calls, whole) = (faults.calls(), pixels(&output));
        assert_eq!(faults.complaints(), Vec::<String>::new(), "{}", method.key);
        let chosen = sample(calls.len(), if method.key == "face-cluster" { 2 } else { 4 });
        let start = Instant::now();
        for &at in &chosen {
            std::fs::remove_file(&output).unwrap();
            faults.fail(at, Failure::OutOfHostMemory);
            let result = render(method.key, &options);
            let name = faults.failed().unwrap_or("none");
            let what = format!("{}, call {at} ({name})", method.key);
            match result {
                Ok(()) => assert!(pixels(&output) == whole, "{what}: another picture"),
                Err(error) => {
                    let message = error.to_string();
                    let no_device = ["vkEnumerateDeviceExtensionProperties"].contains(&name);
                    assert_eq!(error.exit_code(), if no_device { 3 } else { 1 }, "{what}: {message}");
                    assert!(message.contains("memory") || message.contains("MEMORY"), "{what}: {message}");
                    assert_eq!(names(folder.path()), Vec::<String>::new(), "{what}: something is left");
                    std::fs::write(&output, "").unwrap();
                }
            }
            assert_eq!(faults.complaints(), Vec::<String>::new(), "{what}");
        }
        println!("  {:<20} {} of {} calls failed, {:.1?}", method.key, chosen.len(), calls.len(), start.elapsed());
    }
}

#[test]
fn renders_end_where_the_device_is_lost() {
    if !is_apart("renders::renders_end_where_the_device_is_lost") {
        return;
    }
    let _turn = TURN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (output, profile, crash) = (path("out.exr"), path("profile.json"), path("crash.json"));
    let _layer = keep_layer();
    let faults = FaultInjection::start();
    for method in chosen_methods() {
        // Maps that were kept need none of the passes that make them.
        let kept: &[&str] = if method.key == "surface-shadow-maps" { &["--set", "keep_maps=false"] } else { &[] };
        let options = [&["-o", &output, "--profile", &profile], elements(method.key), kept].concat();
        render(method.key, &options).unwrap_or_else(|error| panic!("{}: {error}", method.key));
        let mut passes: Vec<String> =
            Profile::read(Path::new(&profile)).unwrap().passes.into_iter().map(|pass| pass.name).collect();
        passes.sort();
        passes.dedup();
        let chosen = sample(passes.len(), 2);
        for pass in chosen.iter().map(|at| &passes[*at as usize - 1]) {
            [&output, &profile, &crash].into_iter().for_each(|path| drop(std::fs::remove_file(path)));
            faults.fail(0, Failure::DeviceLost);
            let lose = ["--validate", "--lose-device-at", pass, "--crash-file", &crash];
            let error = render(method.key, &[&options, &lose[..]].concat()).expect_err(pass);
            let what = format!("{}, lost in {pass}", method.key);
            assert!(error.exit_code() == 1 && error.to_string().contains(pass.as_str()), "{what}: {error}");
            assert_eq!(names(folder.path()), ["crash.json"], "{what}");
            assert_eq!(faults.complaints(), Vec::<String>::new(), "{what}");
        }
        println!("  {:<20} lost in {} of {} passes", method.key, chosen.len(), passes.len());
    }
}

/// Outputs of every kind, a scene and an environment from files, and the caches.
#[test]
fn renders_survive_files_that_fail() {
    if !is_apart("renders::renders_survive_files_that_fail") {
        return;
    }
    let _turn = TURN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let (inputs, folder) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let environment = inputs.path().join("sky.exr");
    let sky = image::Picture::new(4, 2, vec![glam::Vec3::ONE; 8]).unwrap();
    image::write_exr(&environment, &sky).unwrap();
    let outputs: Vec<PathBuf> =
        ["out.png", "profile.json", "out.trace.json", "hashes.json"].map(|name| folder.path().join(name)).to_vec();
    let out: Vec<&str> = outputs.iter().map(|path| path.to_str().unwrap()).collect();
    let faults = FileFaults::start();
    for method in ["explicit-visibility", "surface-shadow-maps", "face-cluster"] {
        let env = environment.to_str().unwrap();
        let files = ["-o", out[0], "--profile", out[1], "--trace", out[2], "--env", env];
        // Hashes take a submission for every buffer.
        let hashes: &[&str] = if method == "explicit-visibility" { &["--hashes", out[3]] } else { &[] };
        let options = [&files[..], hashes, elements(method)].concat();
        faults.fail(0);
        render(method, &options).unwrap();
        faults.fail(0);
        render(method, &options).unwrap();
        let (count, whole) = (faults.count(), std::fs::read(&outputs[0]).unwrap());
        assert!(count > 15, "{count}");
        let mut refused = 0;
        for at in sample(count as usize, if hashes.is_empty() { 3 } else { 10 }) {
            outputs.iter().for_each(|path| drop(std::fs::remove_file(path)));
            faults.fail(at);
            let result = render(method, &options);
            let failed = faults.failed().unwrap_or_default();
            match result {
                // A cache that cannot be read or written costs time alone.
                Ok(()) => assert!(std::fs::read(&outputs[0]).unwrap() == whole, "{method}, {failed}: another picture"),
                Err(error) => {
                    assert_eq!(error.exit_code(), 1, "{method}, {failed}: {error}");
                    assert!(error.to_string().contains(PLANTED), "{method}, {failed}: {error}");
                    refused += 1;
                }
            }
            for path in &outputs {
                // Whole or not there: JSON ends, pictures open.
                match std::fs::read(path) {
                    Ok(bytes) if path.extension().is_some_and(|extension| extension == "json") => {
                        assert!(serde_json::from_slice::<serde_json::Value>(&bytes).is_ok(), "{method}, {failed}");
                    }
                    Ok(_) => drop(pixels(path)),
                    Err(_) => {}
                }
            }
            let left = names(folder.path());
            assert!(
                left.iter().all(|name| out.iter().any(|path| path.ends_with(name))),
                "{method}, {failed}: {left:?}"
            );
        }
        println!("  {method:<20} {count} accesses to files, {refused} failures refused");
        assert!(refused > 0, "{method}: {refused} of {count} failures were noticed");
    }
}
