//! `linklight render --explain`: the parts that are told make up the pixel of the picture that is written.

use std::path::Path;
use std::process::Command;

use linklight::report::image::read;
use serde_json::Value;

const SCENE: &str = "builtin:cornell-box --size 32x24 --elements 400 --bounces 2 --spp 2 --set rays_per_element=64";

/// Runs `render` with `--explain`; its text, its data, and the picture's pixel.
fn explained(folder: &Path, options: &str, [x, y]: [usize; 2]) -> (String, Value, [f64; 3]) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_linklight"));
    command.current_dir(folder).args(["render", "--quiet", "--validate", "-o", "a.exr"]);
    command.args(["--explain", &format!("{x},{y}"), "--explain-json", "a.json"]).args(options.split_whitespace());
    let output = command.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{options}: {said}");
    let picture = read(&folder.join("a.exr")).unwrap();
    let pixel = picture.rgb[y * picture.width as usize + x].as_dvec3().to_array();
    let json = serde_json::from_str(&std::fs::read_to_string(folder.join("a.json")).unwrap()).unwrap();
    (String::from_utf8(output.stdout).unwrap(), json, pixel)
}

/// How far the entries are from the pixel, as a share of its brightest channel.
fn difference(json: &Value, pixel: [f64; 3]) -> f64 {
    let entries = json["entries"].as_array().unwrap();
    let most = pixel.into_iter().fold(1e-30, f64::max);
    let off = |c: usize| entries.iter().map(|e| e["radiance"][c].as_f64().unwrap()).sum::<f64>() - pixel[c];
    (0..3).map(|c| off(c).abs()).fold(0.0, f64::max) / most
}

fn entries(json: &Value) -> impl Iterator<Item = &Value> {
    json["entries"].as_array().unwrap().iter()
}

fn share(entry: &Value) -> f64 {
    entry["share"].as_f64().unwrap()
}

/// Entries of a bounce.
fn of_bounce(json: &Value, bounce: u32) -> usize {
    entries(json).filter(|entry| entry["bounce"] == bounce).count()
}

#[test]
fn every_method_and_display_is_explained_and_the_parts_make_the_pixel() {
    let folder = tempfile::tempdir().unwrap();
    for (options, most_off, links) in [
        ("--method explicit-visibility", 1e-4, 12),
        ("--method implicit-visibility --set bins=8 --diffuse", 1e-4, 20),
        ("--method antiradiance --diffuse", 1e-4, 20),
        ("--method antiradiance --set scheme=symmetric --diffuse --display splat", 1e-4, 20),
        // Without a floor below zero, and in whole numbers, links alone make up the light.
        ("--method antiradiance --diffuse --set undershoot=1e9 --set half_tables=false", 1e-4, 20),
        ("--method surface-shadow-maps --display lightmap --set atlas_resolution=32 --set keep_maps=false", 1e-4, 8),
        // Coarse ones: a solution of the default's takes most of the test's time.
        ("--method face-cluster --diffuse --set threshold=1e-3", 1e-4, 1),
        ("--method face-cluster --set threshold=1e-3", 1e-4, 1),
        ("--method explicit-visibility --display final-gather", 1e-4, 20),
        ("--method surface-shadow-maps --set atlas_resolution=32 --set keep_maps=false", 1e-4, 20),
        ("--method path-tracing", 1e-6, 1),
    ] {
        let scene = SCENE.split(" --set").next().unwrap();
        let noisy = scene.replace("--spp 2", "--spp 64");
        let own = match options {
            _ if options.contains("explicit") => SCENE,
            _ if options.contains("path-tracing") => noisy.as_str(),
            _ => scene,
        };
        let (text, json, pixel) = explained(folder.path(), &format!("{own} {options}"), [20, 17]);
        let off = difference(&json, pixel);
        assert!(off < most_off, "{options}: off by {off:.2e}\n{text}");
        // The symmetric scheme knows no single bounces.
        let is_lumped = options.contains("symmetric");
        let told = if is_lumped { entries(&json).count() } else { of_bounce(&json, 1) };
        assert!(told >= links, "{options}: too few links\n{text}");
        assert!(is_lumped || of_bounce(&json, 2) >= 1 && text.contains("bounce 2"), "{options}\n{text}");
        assert!(text.contains("pixel 20,17"), "{text}");
        let rest: f64 = entries(&json).filter(|e| e["source"].as_str().unwrap().contains("rounding")).map(share).sum();
        assert!(
            rest.abs() < if options.contains("1e9") { 1e-3 } else { 0.1 },
            "{options}: {rest} beside links\n{text}"
        );
        assert_eq!(json["method"], options.split_whitespace().nth(1).unwrap());

        // The check itself: an entry that is off, or left out, is found.
        let mut planted = json.clone();
        let brightest = planted["entries"][0]["radiance"][1].as_f64().unwrap();
        planted["entries"][0]["radiance"][1] = (1.01 * brightest).into();
        assert!(difference(&planted, pixel) > most_off, "{options}");
        planted["entries"].as_array_mut().unwrap().remove(0);
        assert!(difference(&planted, pixel) > most_off, "{options}");
    }
}

#[test]
fn lights_and_backgrounds_are_told_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let scene = "builtin:office --size 32x24 --elements 2000 --bounces 1 --spp 1 --set rays_per_element=64";
    let (width, height) = (32, 24);
    explained(folder.path(), &format!("{scene} --direct-only"), [0, 0]);
    let picture = read(&folder.path().join("a.exr")).unwrap();
    let sum = |index: &usize| picture.rgb[*index].element_sum();
    // Neither dark nor a lamp.
    let mut lit: Vec<usize> = (0..width * height).filter(|at| sum(at) > 0.0).collect();
    lit.sort_by(|a, b| sum(a).total_cmp(&sum(b)));
    let at = lit[lit.len() / 2];
    let (text, json, pixel) = explained(folder.path(), scene, [at % width, at / width]);
    assert!(difference(&json, pixel) < 1e-4, "{text}");
    assert!(text.contains(" light "), "{text}");
}

/// Of a wall whose corners stand behind its skirting and show, smoothed, what arrives beside it.
#[test]
fn corners_inside_of_things_are_told_as_what_they_show() {
    let folder = tempfile::tempdir().unwrap();
    let scene = "builtin:office --size 160x100 --elements 2000 --bounces 1 --spp 4 --method antiradiance --diffuse";
    let (text, json, pixel) = explained(folder.path(), scene, [17, 70]);
    assert!(text.contains("`skirting`") && text.contains("`walls`"), "{text}");
    assert!(difference(&json, pixel) < 1e-4, "{text}");
}

/// Links made by two logical devices: the same file, to the byte.
#[test]
fn a_second_device_for_links_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let render = |name: &str, options: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_linklight"));
        command.current_dir(folder.path()).args(["render", "--quiet", "--validate", "-o", name]);
        let output = command.args(format!("{SCENE} {options}").split_whitespace()).output().unwrap();
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    assert_eq!(render("one.exr", ""), (Some(0), String::new()));
    assert_eq!(render("two.exr", "--link-gpu 0 --profile two.json"), (Some(0), String::new()));
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert!(read("one.exr") == read("two.exr"));
    let profile: Value = serde_json::from_slice(&read("two.json")).unwrap();
    assert_eq!(profile["method"]["device_elements"].as_array().unwrap().len(), 2);
    let (code, said) = render("no.exr", "--link-gpu nonesuch");
    assert!(code != Some(0) && said.contains("nonesuch"), "{said}");
}

#[test]
fn what_cannot_be_explained_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (options, word) in [
        ("--explain 32,0", "32 x 24"),
        ("--explain 3", "X,Y"),
        ("--explain-json a.json", "--explain"),
        ("--explain 3,3 --method implicit-visibility --view charts --set bins=4", "leave --view"),
    ] {
        let scene = SCENE.split(" --set").next().unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_linklight"));
        command.current_dir(folder.path()).args(["render", "--quiet", "-o", "a.exr"]);
        let output = command.args(format!("{scene} {options}").split_whitespace()).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && said.contains(word), "{options}: {said}");
    }
}
