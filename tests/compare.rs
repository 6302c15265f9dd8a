//! `linklight compare` as a black box: data, page, kept reference, limits; and the page in a real browser.

use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;

/// Small and dim; two values of a setting that one method has, and one method without it.
fn compare(folder: &Path, arguments: &[&str]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_linklight"));
    program.env_remove("RUST_LOG").stdin(Stdio::null());
    program.args(["compare", "builtin:perpendicular-plates", "-o", folder.to_str().unwrap()]);
    program.args(["--method", "explicit-visibility", "--frames", "1"]).args(arguments);
    let output = program.output().unwrap();
    assert!(!String::from_utf8_lossy(&output.stderr).contains("panicked"), "{output:?}");
    output
}

const SMALL: [&str; 7] = ["--", "--size", "24x16", "--bounces", "1", "--elements", "300"];

#[track_caller]
fn json(output: &Output) -> Value {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn figures_pictures_and_limits() {
    let folder = tempfile::tempdir().unwrap();
    let few = ["--vary", "rays_per_element=16,256", "--noise", "0.2", "--curve-spp", "4"];
    let first = json(&compare(folder.path(), &[&few[..], &["--json"], &SMALL].concat()));
    assert_eq!((&first["schema"], &first["version"]), (&"linklight-compare".into(), &1.into()));
    let written = std::fs::read(folder.path().join("compare.json")).unwrap();
    assert_eq!(serde_json::from_slice::<Value>(&written).unwrap(), first);

    let scene = &first["scenes"][0];
    let reference = &scene["reference"];
    let noise = reference["noise"].as_f64().unwrap();
    assert!(noise > 0.0 && noise <= 0.2, "{noise}");
    let samples: Vec<_> = scene["path_tracing"].as_array().unwrap().iter().map(|p| p["samples"].as_u64()).collect();
    assert_eq!(samples, [Some(1), Some(2), Some(4)]);
    let errors: Vec<f64> =
        scene["path_tracing"].as_array().unwrap().iter().map(|p| p["figures"]["rmse"].as_f64().unwrap()).collect();
    assert!(errors[2] < errors[0], "more paths, less error: {errors:?}");

    let runs = scene["runs"].as_array().unwrap();
    let variations: Vec<&str> = runs.iter().map(|run| run["variation"].as_str().unwrap()).collect();
    assert_eq!(variations, ["rays_per_element=16", "rays_per_element=256"]);
    for run in runs {
        let done = &run["outcome"]["done"];
        for file in ["png", "exr", "flip", "relative"] {
            assert!(folder.path().join(done[file].as_str().unwrap()).is_file(), "{file} of {run}");
        }
        let energy = done["figures"]["mean_ratio"].as_f64().unwrap();
        assert!((0.8..1.2).contains(&energy), "{energy}");
        assert_eq!(done["bounce_energy"].as_array().unwrap().len(), 2);
        let cost = &done["cost"];
        assert!(cost["prepare_ms"].as_f64().unwrap() > 0.0 && cost["frame_ms"]["median"].as_f64().unwrap() > 0.0);
        assert!(cost["peak_bytes"].as_u64().unwrap() > 0 && !cost["passes"].as_array().unwrap().is_empty());
    }

    // The command in a cell makes the picture of the cell, bit for bit.
    let command = runs[0]["command"].as_str().unwrap();
    let exr = folder.path().join(runs[0]["outcome"]["done"]["exr"].as_str().unwrap());
    let before = linklight::report::image::read(&exr).unwrap();
    let mut words = command.split(' ');
    assert_eq!(words.next(), Some("linklight"));
    assert!(Command::new(env!("CARGO_BIN_EXE_linklight")).args(words).output().unwrap().status.success());
    assert_eq!(linklight::report::image::read(&exr).unwrap().rgb, before.rgb);

    // Again: the reference is kept, the figures are the same, and a limit is a test.
    let again = compare(folder.path(), &[&few[..], &["--json", "--fail-above", "relmse=1e-9"], &SMALL].concat());
    assert_eq!(again.status.code(), Some(1));
    let (log, data) = (String::from_utf8_lossy(&again.stderr), serde_json::from_slice::<Value>(&again.stdout).unwrap());
    assert!(log.contains("as kept") && log.contains("relmse") && log.contains("is above 0.000000001"), "{log}");
    let figures = |data: &Value, run: usize| data["scenes"][0]["runs"][run]["outcome"]["done"]["figures"].clone();
    assert_eq!([figures(&data, 0), figures(&data, 1)], [figures(&first, 0), figures(&first, 1)]);

    // Against a picture that was given: itself has no error.
    let given = ["--set", "rays_per_element=16", "--reference", exr.to_str().unwrap(), "--curve-spp", "0", "--json"];
    let other = tempfile::tempdir().unwrap();
    let same = json(&compare(other.path(), &[&given[..], &SMALL].concat()));
    assert_eq!(figures(&same, 0)["rmse"], 0.0);
    assert_eq!(same["scenes"][0]["reference"]["noise"], Value::Null);

    in_a_browser(folder.path());
}

/// A run that fails is a cell of the page, an error and no hole in the rest.
#[test]
fn a_failed_run_does_not_end_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let camera = ["--noise", "1", "--curve-spp", "0", "--vary", "camera=0,nowhere"];
    let output = compare(folder.path(), &[&camera[..], &SMALL].concat());
    assert_eq!(output.status.code(), Some(1));
    let data: Value = serde_json::from_slice(&std::fs::read(folder.path().join("compare.json")).unwrap()).unwrap();
    let runs = &data["scenes"][0]["runs"];
    assert!(runs[0]["outcome"]["done"].is_object(), "{runs}");
    assert!(runs[1]["outcome"]["failed"].as_str().unwrap().contains("nowhere"), "{runs}");
}

/// The symmetric scheme holds a bounce for each of its steps, whatever `--bounces` says; its figures are of a reference of as many.
#[test]
fn a_method_that_holds_other_bounces_is_held_to_as_many() {
    let folder = tempfile::tempdir().unwrap();
    let symmetric = ["--method", "antiradiance", "--set", "scheme=symmetric", "--set", "bins=72", "--curve-spp", "0"];
    let steps = ["--vary", "iterations=1,3", "--noise", "1", "--json"];
    let data = json(&compare(folder.path(), &[&symmetric[..], &steps, &SMALL].concat()));
    let held = |run: usize| {
        data["scenes"][0]["runs"]
            .as_array()
            .unwrap()
            .iter()
            .map(|run| &run["outcome"]["done"]["bounces_held"])
            .filter(|held| **held == run)
            .count()
    };
    // One of explicit visibility, which has no such setting.
    assert_eq!((held(1), held(3)), (0, 1), "{data}");
    assert!(folder.path().join("perpendicular-plates/reference-3-bounces.exr").is_file());
    assert!(std::fs::read_to_string(folder.path().join("index.html")).unwrap().contains("a reference of 3 bounces"));
}

#[test]
fn wrong_usage_is_told_before_any_work() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, message) in [
        (vec!["--set", "rays_per_elemnt=3"], "rays_per_elemnt"),
        (vec!["--vary", "elemnts=3"], "elemnts"),
        (vec!["--vary", "rays_per_element=17"], "17"),
        (vec!["--vary", "x"], "NAME=VALUE"),
        (vec!["--noise", "0"], "above 0"),
        (vec!["--", "--profile", "p.json"], "--profile"),
    ] {
        let output = compare(folder.path(), &arguments);
        let log = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {log}");
        assert!(log.contains(message), "{message:?} is not in: {log}");
    }
}

/// The page sorts and its pictures load, in headless Chromium where there is one.
fn in_a_browser(folder: &Path) {
    let page = std::fs::read_to_string(folder.join("index.html")).unwrap();
    let probe = "<script>addEventListener('load', () => {
        const heads = [...document.querySelectorAll('th[data-key]')];
        const error = heads.findIndex(head => head.textContent === 'relative MSE');
        const order = () => [...document.querySelectorAll('.figures tbody tr')].map(row => Number(row.cells[error].dataset.value));
        heads[error].click();
        const rising = order();
        heads[error].click();
        const falling = order();
        const sorted = rising.length === 2 && rising[0] <= rising[1] && falling[0] === rising[1] && falling[1] === rising[0];
        document.querySelectorAll('img').forEach(image => image.loading = 'eager');
        Promise.all([...document.images].map(image => image.decode())).then(
            () => document.title = `sorted ${sorted}, ${document.images.length} pictures`,
            error => document.title = `a picture is missing: ${error}`);
    });</script>";
    std::fs::write(folder.join("probe.html"), page.replace("</body>", &format!("{probe}</body>"))).unwrap();
    let profile = tempfile::tempdir().unwrap();
    let output = Command::new("chromium")
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--dump-dom"])
        .args(["--disable-background-networking", "--disable-component-update", "--disable-sync"])
        .args(["--virtual-time-budget=10000", "--allow-file-access-from-files"])
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .arg(format!("file://{}", folder.join("probe.html").display()))
        .output();
    let Ok(output) = output else {
        println!("no chromium on PATH: the page was not opened in a browser");
        return;
    };
    let dom = String::from_utf8_lossy(&output.stdout);
    let title = dom.split("<title>").nth(1).and_then(|rest| rest.split("</title>").next());
    // Two runs: reference, picture and two maps each.
    assert_eq!(title, Some("sorted true, 8 pictures"), "{}", String::from_utf8_lossy(&output.stderr));
}
