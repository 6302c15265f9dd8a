//! What people type: settings, command lines, and the state files that the viewer writes.

use crate::Target;
use crate::mutate::{self, Random};
use clap::Parser as _;
use linklight::app::cli::{Cli, Command};
use linklight::app::render::RenderRequest;
use linklight::app::{AppError, state};
use linklight::methods::settings::Assignment;
use linklight::methods::{METHODS, find};
use std::ffi::OsString;
use std::path::Path;

pub const SETTINGS: Target =
    Target { name: "settings", runs: 4_000, seeds: settings, mutate: bend, read: read_settings, max_bytes: 4 << 20 };
pub const COMMAND_LINE: Target = Target {
    name: "command-line",
    runs: 800,
    seeds: command_lines,
    mutate: bend,
    read: read_line,
    max_bytes: 16 << 20,
};
pub const STATE: Target =
    Target { name: "state", runs: 800, seeds: states, mutate: bend, read: read_state, max_bytes: 16 << 20 };

/// What may stand on a command line beside what does.
const WORDS: [&str; 48] = [
    "render",
    "view",
    "bench",
    "compare",
    "--method",
    "--method=antiradiance",
    "path-tracing",
    "auto",
    "--display=final-gather",
    "--display",
    "vertex",
    "splat",
    "--bounces=64",
    "--size=16384x1",
    "0x0",
    "--spp=1048576",
    "--seconds=1e6",
    "--camera=",
    "--eye=1,2,3",
    "--look-at=1,2,3",
    "--fov=179",
    "--env=1,1,1",
    "--env=",
    "--env-turn=-360",
    "--elements=50000000",
    "--set",
    "rays_per_element=64",
    "bins=128",
    "pick=4294967295",
    "pick=9999999999,3",
    "--edit=material:0.albedo=1,1,1",
    "--edit=node:4294967295.move=-1e6",
    "--view=bins",
    "--target-error=0.5",
    "--channels=depth,depth",
    "--max-memory=1M",
    "--max-memory=99999999T",
    "--state",
    "--",
    "-o",
    "out.exr",
    "out.png",
    "builtin:maze",
    "builtin:gallery?triangles=4294967296",
    "builtin:closed-rooms?wall=0&sides=two&wall=1",
    "--vary=bins=1,,2",
    "--fail-above=rmse=nan",
    "-vvv",
];

fn bend(random: &mut Random, seeds: &[Vec<u8>]) -> Vec<u8> {
    let seed = String::from_utf8_lossy(random.pick::<Vec<u8>>(seeds)).into_owned();
    mutate::text(random, &seed, &WORDS)
}

/// A method's key, then one `KEY=VALUE` a line: each method with all its defaults.
fn settings() -> Vec<Vec<u8>> {
    let seed = |method: &linklight::methods::Method| {
        let record = method.record(&[]).expect("defaults are allowed");
        let lines = record.iter().map(|(key, value)| {
            let value = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
            format!("{key}={value}")
        });
        std::iter::once(method.key.to_owned()).chain(lines).collect::<Vec<_>>().join("\n").into_bytes()
    };
    METHODS.iter().map(seed).collect()
}

fn read_settings(input: &[u8], _: &Path) {
    let text = String::from_utf8_lossy(input);
    let mut lines = text.lines();
    let method = lines.next().and_then(find).unwrap_or(&METHODS[input.len() % METHODS.len()]);
    let mut taken = Vec::new();
    for assignment in lines.filter_map(|line| Assignment::parse(line).ok()) {
        match method.record(std::slice::from_ref(&assignment)) {
            Ok(_) => taken.push(assignment),
            Err(error) => assert!(error.to_string().len() < 2000 + 2 * text.len(), "{error}"),
        }
    }
    // What is taken one by one is taken together, and reads back as it was recorded.
    let record = method.record(&taken).expect("settings taken before");
    for (key, value) in &record {
        let value = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        let again = method.record(&[Assignment { key: key.clone(), value }]).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(again[key], record[key], "{key}");
    }
}

/// One word a line.
fn command_lines() -> Vec<Vec<u8>> {
    [
        "render scene.glb -o out.exr --method explicit-visibility --bounces=2 --size=64x36 --set=rays_per_element=64",
        "render builtin:maze -o out.png --method=antiradiance --display=splat --seconds=0.5 --exposure=-1 --tonemap=filmic",
        "render builtin:dancer -o out.exr --method path-tracing --spp=9 --channels=depth,direct --eye=1,2,3 --look-at=0,0,0",
        "view scene.gltf --env=0.1,0.2,0.3 --env-turn=-90 --edit=material:3.albedo=0.8,0.2,0.1 --seed=7",
        "bench builtin:furnace -o out.json --vary=bins=64,128 --precision=0.05 --seconds=3 -- --size=8x8",
        "compare builtin:furnace -o out --noise=0.1 --fail-above=rmse=0.5 -- --bounces 2",
        "--gpu 0 --quiet --max-memory=512M diff a.png b.png --fail-above=flip=0.1",
    ]
    .map(|line| line.replace(' ', "\n").into_bytes())
    .to_vec()
}

/// Parsed, and where it is a picture also checked as a whole. Nothing is rendered.
fn check(words: Vec<OsString>) -> Result<(), AppError> {
    let Ok(cli) = Cli::try_parse_from(words) else { return Ok(()) };
    let request = match cli.command {
        Command::Render(args) => RenderRequest::try_from(*args)?,
        Command::View(args) => {
            state::options(&args.picture);
            RenderRequest::of_picture(&args.picture, "out.exr".parse().expect("a picture's name"))?
        }
        _ => return Ok(()),
    };
    request.record().map(drop)
}

fn read_line(input: &[u8], _: &Path) {
    let text = String::from_utf8_lossy(input);
    // Files that a line names are not there; nul bytes cannot be in a real one.
    let words = std::iter::once("linklight").chain(text.lines()).map(|word| OsString::from(word.replace('\0', "")));
    let words: Vec<OsString> = words.collect();
    if words.iter().any(|word| word.to_string_lossy().contains("--state")) {
        drop(state::expand(words));
    } else {
        drop(check(words));
    }
}

fn states() -> Vec<Vec<u8>> {
    let line = |text: &str| {
        let words = std::iter::once("linklight").chain(text.split(' ')).map(OsString::from);
        let Command::View(args) = Cli::try_parse_from(words).expect("a sound line").command else { unreachable!() };
        state::options(&args.picture).join("\n").into_bytes()
    };
    vec![
        line("view builtin:maze --bounces=2 --seed=3 --display=final-gather --env=1,1,1"),
        line("view a.glb --eye=1,2,3 --look-at=0,0,0 --set=rays_per_element=64 --edit=light:0.intensity=3 --diffuse"),
        b"# a comment\n\nbuiltin:dancer\n--method=implicit-visibility\n--seconds=0.25\n".to_vec(),
    ]
}

fn read_state(input: &[u8], folder: &Path) {
    let path = folder.join("shot.state");
    std::fs::write(&path, input).unwrap();
    for command in ["render", "view"] {
        let mut words: Vec<OsString> = ["linklight", command, "--state"].map(OsString::from).to_vec();
        words.push(path.clone().into());
        if command == "render" {
            words.extend(["-o", "out.exr", "--bounces=1"].map(OsString::from));
        }
        if let Ok(words) = state::expand(words) {
            drop(check(words));
        }
    }
}

pub fn seeds_are_valid() {
    for seed in command_lines() {
        let text = String::from_utf8(seed).unwrap();
        let words: Vec<OsString> = std::iter::once("linklight").chain(text.lines()).map(OsString::from).collect();
        Cli::try_parse_from(words.clone()).unwrap_or_else(|error| panic!("{error}"));
        check(words).unwrap_or_else(|error| panic!("{error}"));
    }
    for seed in settings() {
        let text = String::from_utf8(seed).unwrap();
        let mut lines = text.lines();
        let method = find(lines.next().unwrap()).unwrap();
        let assignments: Vec<Assignment> = lines.map(|line| Assignment::parse(line).unwrap()).collect();
        assert_eq!(method.record(&assignments).unwrap(), method.record(&[]).unwrap());
    }
    let folder = tempfile::tempdir().unwrap();
    for seed in states() {
        let path = folder.path().join("seed.state");
        std::fs::write(&path, seed).unwrap();
        let words = ["linklight".into(), "view".into(), "--state".into(), path.into_os_string()];
        let words = state::expand(words).unwrap_or_else(|error| panic!("{error}"));
        Cli::try_parse_from(words).unwrap_or_else(|error| panic!("{error}"));
    }
}
