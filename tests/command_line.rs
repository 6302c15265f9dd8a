//! The `linklight` program as a black box: exit codes, messages, files.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use glam::Vec3;
use linklight::report::image::{self, Metadata, Picture};
use serde_json::Value;

/// What a run left: exit code, standard output, standard error.
struct Run {
    code: i32,
    out: String,
    err: String,
}

fn linklight(arguments: &[&str]) -> Run {
    run(program().args(arguments))
}

fn program() -> Command {
    let mut program = Command::new(env!("CARGO_BIN_EXE_linklight"));
    program.env_remove("RUST_LOG").stdin(Stdio::null());
    program
}

fn run(program: &mut Command) -> Run {
    let output = program.output().expect("the program starts");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8 output");
    let run = Run {
        code: output.status.code().expect("no signal ended it"),
        out: text(output.stdout),
        err: text(output.stderr),
    };
    assert!(!run.err.contains("panicked"), "{}", run.err);
    run
}

impl Run {
    #[track_caller]
    fn fails(&self, code: i32, message: &str) {
        assert_eq!(self.code, code, "{}{}", self.out, self.err);
        assert!(self.err.starts_with("error: ") || self.err.contains("\nerror: "), "{}", self.err);
        assert!(self.err.contains(message), "{message:?} is not in: {}", self.err);
    }

    #[track_caller]
    fn succeeds(&self) -> &str {
        assert_eq!(self.code, 0, "{}", self.err);
        &self.out
    }

    #[track_caller]
    fn json(&self) -> Value {
        serde_json::from_str(self.succeeds()).expect("JSON output")
    }
}

/// A folder of pictures; paths are handed out as text.
struct Pictures(tempfile::TempDir);

impl Pictures {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn text(&self, name: &str) -> String {
        self.path(name).to_str().unwrap().to_owned()
    }

    fn exr(&self, name: &str, picture: &Picture) -> String {
        image::write_exr(&self.path(name), picture).unwrap();
        self.text(name)
    }

    fn png(&self, name: &str, byte: impl Fn(usize) -> u8) -> String {
        let bytes: Vec<u8> = (0..24 * 24 * 3).map(byte).collect();
        image::write_png(&self.path(name), 24, 24, &bytes, &Metadata::new()).unwrap();
        self.text(name)
    }

    fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.path()).unwrap();
        let mut names: Vec<String> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

fn picture(width: u32, height: u32, value: impl Fn(u32, u32) -> f32) -> Picture {
    let pixels = (0..width * height).map(|index| Vec3::splat(value(index % width, index / width))).collect();
    Picture::new(width, height, pixels).unwrap()
}

/// 24 x 24, 0.5 to 1.
fn ramp() -> Picture {
    picture(24, 24, |x, y| 0.5 + (x + y) as f32 / 92.0)
}

#[test]
fn help_and_version_are_no_errors() {
    assert!(linklight(&["--help"]).succeeds().contains("Exit codes: 0 done"));
    assert!(linklight(&["--version"]).succeeds().starts_with("linklight "));
    for command in ["render", "diff", "devices", "methods"] {
        assert!(linklight(&[command, "--help"]).succeeds().contains("--validate"), "global options show in {command}");
    }
}

#[test]
fn wrong_usage_is_exit_code_2_and_says_what_is_allowed() {
    let render = ["render", "a.glb", "-o", "a.png"];
    let cases: [(&[&str], &str); 22] = [
        (&["paint"], "unrecognized subcommand"),
        (&["diff", "a.png"], "<B>"),
        (&["render", "a.glb"], "--output"),
        (&["render", "a.obj", "-o", "a.png"], "a scene is a .gltf or .glb file, or builtin:NAME"),
        (&["render", "builtin:nowhere", "-o", "a.png"], "there is no built-in scene 'nowhere'; choose one of: "),
        (&["render", "a.glb", "-o", "a.jpg"], "the name must end in .exr or .png"),
        (&["--quiet", "-v", "methods"], "cannot be used with"),
        (&["diff", "a.png", "b.png", "--fail-above", "mse=1"], "did you mean"),
        (&["diff", "a.png", "b.png", "--fail-above", "rmse"], "expected FIGURE=LIMIT"),
        (&["diff", "a.png", "b.png", "--fail-above", "rmse=-1"], "not a number of at least 0"),
        (&["diff", "a.png", "b.png", "-o", "map.exr"], "must end in .png"),
        (&["diff", "a.png", "b.png", "--map", "flip"], "--output"),
        (&["--method", "radiosity"], "there are explicit-visibility, "),
        (&["--method", "path-trace"], "did you mean path-tracing?"),
        (&["--set", "rays=9"], "did you mean"),
        (&["--set", "rays_per_element=9"], "one of 16, 64, 144, 256"),
        (&["--size", "0x10"], "a side is 1 to 16384 pixels"),
        (&["--env", "1,2"], "three numbers"),
        (&["--spp", "0"], "0 is not in 1..=1048576"),
        (&["--exposure", "nan"], "a number from -32 to 32 stops"),
        (&["--seconds", "-1"], "a number from 0 to"),
        (&["--channels", "depth"], "needs an .exr"),
    ];
    for (arguments, message) in cases {
        let line = if arguments[0].starts_with("--") && arguments[0] != "--quiet" { &render[..] } else { &[] };
        let run = linklight(&[line, arguments].concat());
        assert_eq!(run.code, 2, "{arguments:?}: {}", run.err);
        assert!(run.err.contains(message), "{arguments:?}: {message:?} is not in: {}", run.err);
        assert!(run.out.is_empty(), "{arguments:?}: messages belong on standard error");
    }
    assert_eq!(linklight(&[]).code, 2);
    assert!(!Path::new("a.png").exists());
}

#[test]
fn methods_lists_papers_and_settings() {
    let run = linklight(&["methods"]);
    let text = run.succeeds();
    assert!(text.contains("explicit-visibility: ") && text.contains("path-tracing: "));
    assert!(text.contains("https://doi.org/10.1111/j.1467-8659.2008.01347.x"));
    assert!(text.contains("--set rays_per_element=256"));

    let json = linklight(&["methods", "--json"]).json();
    assert_eq!((&json["schema"], &json["version"]), (&"linklight-methods".into(), &1.into()));
    let methods = json["methods"].as_array().unwrap();
    assert_eq!(methods[0]["paper"]["year"], 2008);
    for setting in methods.iter().flat_map(|method| method["settings"].as_array().unwrap()) {
        for key in ["name", "type", "default", "unit", "doc", "paper"] {
            assert!(!setting[key].is_null(), "{setting}");
        }
        assert!(setting["type"] != "int" || setting["max"].is_u64(), "{setting}");
    }
}

#[test]
fn a_reader_that_goes_away_is_no_error() {
    let mut child =
        program().arg("methods").stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn what_needs_more_memory_than_allowed_is_refused() {
    let folder = Pictures::new();
    let output = folder.text("out.png");
    let render =
        |scene: &str, options: &[&str]| linklight(&[&["render", scene, "-o", &output, "--quiet"], options].concat());
    render("builtin:gallery?triangles=1500000", &["--max-memory", "64M"]).fails(1, "raise --max-memory");
    render("builtin:cornell-box", &["--elements", "5000000", "--max-memory", "64M"]).fails(1, "raise --max-memory");
    // What is too large for the device alone, and would take gigabytes.
    render("builtin:furnace", &["--size=2600x2600", "--max-memory", "96M"]).fails(1, "--max-memory");
    render("builtin:furnace", &["--max-memory", "9"]).fails(2, "at least 1M");
    assert!(folder.names().is_empty(), "nothing is written");
}

#[test]
fn without_a_driver_the_exit_code_is_3_and_nothing_is_written() {
    let folder = Pictures::new();
    let without_driver = |arguments: &[&str]| {
        let missing = folder.path("no-such-driver.json");
        run(program().args(arguments).env("VK_DRIVER_FILES", &missing).env("VK_ICD_FILENAMES", &missing))
    };
    without_driver(&["devices"]).fails(3, "tools/setup");
    let output = folder.text("a.png");
    without_driver(&["render", "builtin:cornell-box", "-o", &output]).fails(3, "tools/setup");
    assert!(folder.names().is_empty(), "{:?}", folder.names());
}

#[test]
fn outputs_that_cannot_be_written_fail_before_the_work() {
    let folder = Pictures::new();
    let output = folder.text("missing/a.png");
    linklight(&["render", "builtin:cornell-box", "-o", &output]).fails(1, "does not exist; create it first");
    std::fs::create_dir(folder.path("folder.png")).unwrap();
    linklight(&["render", "builtin:cornell-box", "-o", &folder.text("folder.png")]).fails(1, "it is a folder");
    let (a, profile) = (folder.text("a.exr"), folder.text("missing/p.json"));
    linklight(&["render", "builtin:cornell-box", "-o", &a, "--profile", &profile]).fails(1, "missing/p.json");
    linklight(&["render", "builtin:cornell-box", "-o", &a, "--trace", &a]).fails(2, "two outputs are called");
}

#[test]
fn diff_of_a_picture_with_itself_is_zero() {
    let folder = Pictures::new();
    let exr = folder.exr("a.exr", &ramp());
    let png = folder.png("a.png", |index| index as u8);
    let limits = ["rmse=0", "relmse=0", "energy=0", "p95=0", "ssim=0", "flip=0", "flip-p95=0"];
    for path in [exr, png] {
        let mut arguments = vec!["diff", path.as_str(), path.as_str(), "--json"];
        limits.iter().for_each(|limit| arguments.extend(["--fail-above", limit]));
        let json = linklight(&arguments).json();
        assert_eq!((&json["pixels"], &json["figures"]["ssim"]), (&576.into(), &1.0.into()));
        assert_eq!((&json["figures"]["flip"], &json["figures"]["energy"]), (&0.0.into(), &1.0.into()));
        assert_eq!(json["limits"].as_array().unwrap().len(), limits.len());
    }
}

#[test]
fn every_limit_of_diff_can_fail() {
    let folder = Pictures::new();
    let reference = folder.exr("b.exr", &ramp());
    let wrong = folder.exr("a.exr", &picture(24, 24, |x, y| if (x + y) % 2 == 0 { 2.0 } else { 0.1 }));
    for figure in ["rmse", "relmse", "energy", "p95", "ssim", "flip", "flip-p95"] {
        let limit =
            |limit: &str| linklight(&["diff", &wrong, &reference, "--fail-above", &format!("{figure}={limit}")]);
        limit("0.01").fails(1, &format!("{figure} "));
        assert!(limit("0.01").out.contains(figure), "the figures are printed all the same");
        limit("1e6").succeeds();
    }
    let two = ["diff", &wrong, &reference, "--fail-above", "rmse=0.001", "--fail-above", "flip=0.001", "--json"];
    let run = linklight(&two);
    run.fails(1, "; flip ");
    let json: Value = serde_json::from_str(&run.out).unwrap();
    assert_eq!((&json["limits"][0]["above"], &json["limits"][1]["above"]), (&true.into(), &true.into()));
}

#[test]
fn a_black_reference_fails_relative_limits() {
    let folder = Pictures::new();
    let black = folder.exr("b.exr", &picture(24, 24, |_, _| 0.0));
    let lit = folder.exr("a.exr", &ramp());
    let run = linklight(&["diff", &lit, &black, "--json"]);
    assert!(run.json()["figures"]["relmse"].is_null());
    linklight(&["diff", &lit, &black, "--fail-above", "relmse=1000"]).fails(1, "relmse is undefined");
    linklight(&["diff", &black, &black, "--fail-above", "relmse=0"]).succeeds();
}

#[test]
fn what_cannot_be_compared_is_exit_code_1() {
    let folder = Pictures::new();
    let good = folder.exr("good.exr", &ramp());
    let mut bad = ramp();
    bad.rgb[49].y = f32::NAN;
    bad.rgb[50].x = f32::INFINITY;
    let bad = folder.exr("bad.exr", &bad);
    linklight(&["diff", &bad, &good]).fails(1, "picture holds 2 NaN or infinite pixels, the first at column 1, row 2");
    linklight(&["diff", &good, &bad]).fails(1, "reference holds 2 NaN or infinite pixels");
    let small = folder.exr("small.exr", &picture(24, 23, |_, _| 1.0));
    linklight(&["diff", &small, &good]).fails(1, "24x23 pixels and the reference 24x24");
    linklight(&["diff", &good, &good, "--mask", &small]).fails(1, "the mask is 24x23");
    let png = folder.png("a.png", |_| 128);
    linklight(&["diff", &png, &good]).fails(1, "compare two of a kind");
    std::fs::write(folder.path("text.png"), "not a picture").unwrap();
    linklight(&["diff", &folder.text("text.png"), &good]).fails(1, "is not a picture");
    linklight(&["diff", &good, &folder.text("missing.exr")]).fails(1, "missing.exr");
    let bytes = std::fs::read(folder.path("good.exr")).unwrap();
    std::fs::write(folder.path("cut.exr"), &bytes[..bytes.len() / 2]).unwrap();
    linklight(&["diff", &folder.text("cut.exr"), &good]).fails(1, "(EXR) is damaged or not supported");
    linklight(&["diff", &good, &good, "--layer", "direct"]).fails(1, "no layer \"direct\"");
}

#[test]
fn masks_and_layers_choose_what_is_compared() {
    let folder = Pictures::new();
    let reference = folder.exr("b.exr", &ramp());
    let wrong =
        folder.exr("a.exr", &picture(24, 24, |x, y| (0.5 + (x + y) as f32 / 92.0) * if x < 12 { 1.0 } else { 3.0 }));
    let mask = folder.png("mask.png", |index| if (index / 3) % 24 < 12 { 255 } else { 0 });
    linklight(&["diff", &wrong, &reference, "--mask", &mask, "--fail-above", "rmse=0"]).succeeds();
    linklight(&["diff", &wrong, &reference, "--fail-above", "rmse=0.1"]).fails(1, "rmse");

    let layered = |name: &str, direct: f32| {
        let mut picture = ramp();
        picture.add_rgb("direct", &vec![Vec3::splat(direct); 576]).unwrap();
        folder.exr(name, &picture)
    };
    let (one, two) = (layered("one.exr", 1.0), layered("two.exr", 2.0));
    linklight(&["diff", &one, &two, "--fail-above", "rmse=0"]).succeeds();
    let json = linklight(&["diff", &one, &two, "--layer", "direct", "--json"]).json();
    assert_eq!((&json["figures"]["rmse"], &json["layer"]), (&1.0.into(), &"direct".into()));
}

#[test]
fn heat_maps_are_written_whole_or_not_at_all() {
    let folder = Pictures::new();
    let reference = folder.exr("b.exr", &ramp());
    let wrong = folder.exr("a.exr", &picture(24, 24, |x, _| if x < 12 { 0.7 } else { 5.0 }));
    let map = folder.text("map.png");
    for kind in ["flip", "relative"] {
        linklight(&["diff", &wrong, &reference, "-o", &map, "--map", kind, "--fail-above", "rmse=0"]).fails(1, "rmse");
        let drawn = image::read(Path::new(&map)).unwrap();
        let brightness = |x: usize| drawn.rgb[12 * 24 + x].element_sum();
        assert!(brightness(20) > 2.0 * brightness(3), "{kind}: the wrong half is brighter");
        assert!(drawn.metadata["reference"].ends_with("b.exr"));
    }
    let before = std::fs::read(&map).unwrap();
    let mut bad = ramp();
    bad.rgb[0].x = f32::NAN;
    let bad = folder.exr("bad.exr", &bad);
    linklight(&["diff", &bad, &reference, "-o", &map]).fails(1, "NaN");
    assert_eq!(std::fs::read(&map).unwrap(), before, "the older picture stays");
    assert_eq!(folder.names(), ["a.exr", "b.exr", "bad.exr", "map.png"], "no temporary file stays");
}

/// A picture that must be black is told with its reason, and what helps.
#[test]
fn a_scene_without_light_is_told() {
    let folder = Pictures::new();
    let output = folder.text("a.png");
    let line = ["render", "builtin:furnace", "-o", &output, "--size", "8x8", "--spp", "1", "--method", "path-tracing"];
    let dark = ["--edit", "material:0.emission=0,0,0"];
    let tells = |more: &[&str]| {
        let run = linklight(&[&line[..], more].concat());
        run.succeeds();
        run.err.contains("no light") && run.err.contains("--env")
    };
    assert!(tells(&dark));
    assert!(!tells(&[]));
    assert!(!tells(&[&dark[..], &["--env", "1,1,1"]].concat()));
}

#[test]
fn log_settings_that_are_not_understood_are_said_and_ignored() {
    let run = run(program().arg("methods").env("RUST_LOG", "linklight=loudly"));
    run.succeeds();
    assert!(run.err.contains("RUST_LOG"), "{}", run.err);
}

/// Ctrl-C ends long work between two steps: exit code 1, and the old picture stays as it was.
#[cfg(unix)]
#[test]
fn an_interrupt_ends_the_work_and_leaves_files_alone() {
    use std::io::{BufRead as _, BufReader, Read as _};

    let long_work: [(&str, &[&str]); 2] = [
        ("samples of path tracing", &["--method", "path-tracing", "--spp", "65536", "--size", "96x96"]),
        ("link generation", &["--elements", "60000", "--set", "rays_per_element=1024", "--size", "16x16"]),
    ];
    for (work, arguments) in long_work {
        let folder = Pictures::new();
        std::fs::write(folder.path("out.exr"), b"as before").unwrap();
        let mut child = program()
            .args(["render", "builtin:cornell-box", "-v", "-o", &folder.text("out.exr")])
            .args(arguments)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut log = BufReader::new(child.stderr.take().unwrap());
        let mut line = String::new();
        while !line.contains(" elements, ") {
            line.clear();
            assert!(log.read_line(&mut line).unwrap() > 0, "{work}: ended before it began");
        }
        let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
        assert!(kill.success());
        let mut rest = String::new();
        log.read_to_string(&mut rest).unwrap();
        let status = child.wait().unwrap();
        assert_eq!(status.code(), Some(1), "{work}: {rest}");
        assert!(rest.contains("error: interrupted; nothing was written"), "{work}: {rest}");
        let files: Vec<_> = std::fs::read_dir(folder.0.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
        assert_eq!(files, ["out.exr"], "{work}");
        assert_eq!(std::fs::read(folder.path("out.exr")).unwrap(), b"as before", "{work}");
    }
}

/// Face-cluster radiosity can show what was shot before Ctrl-C: the picture is written, and the exit code says 1.
#[cfg(unix)]
#[test]
fn an_interrupted_shooting_is_shown() {
    use std::io::{BufRead as _, BufReader, Read as _};

    let folder = Pictures::new();
    let mut child = program()
        .args(["render", "builtin:cornell-box", "-v", "-o", &folder.text("out.png"), "--method", "face-cluster"])
        .args(["--size", "32x32", "--spp", "1", "--bounces", "64", "--set", "convergence=0"])
        .args(["--profile", &folder.text("p.json")])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut log = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    while !line.contains("direct: ") {
        line.clear();
        assert!(log.read_line(&mut line).unwrap() > 0, "ended before it began");
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let mut rest = String::new();
    log.read_to_string(&mut rest).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(1), "{rest}");
    assert!(rest.contains("the picture shows the light until then"), "{rest}");
    let picture = ::image::open(folder.path("out.png")).unwrap().to_rgb8();
    assert!(picture.pixels().filter(|p| p.0.iter().any(|&c| c > 20)).count() > 500, "the picture is lit");
    let profile: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path("p.json")).unwrap()).unwrap();
    let passes = profile["method"]["iterations"].as_array().unwrap();
    assert!((1..64).contains(&passes.len()) && passes[0]["name"] == "direct", "{passes:?}");
    assert!(passes.iter().all(|pass| pass["transfers"].as_u64().unwrap() > 0), "{passes:?}");
}
