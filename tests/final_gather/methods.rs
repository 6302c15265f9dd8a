//! The gather shows the solution of every method that lives on surfaces, `linklight render` being the black box.

use std::path::Path;
use std::process::{Command, Stdio};

use glam::DVec3;
use linklight::report::image::{Picture, read};

const METHODS: [&str; 5] =
    ["explicit-visibility", "implicit-visibility", "antiradiance", "surface-shadow-maps", "face-cluster"];

fn gathered(folder: &Path, scene: &str, method: &str, options: &str) -> Picture {
    let exr = folder.join("gathered.exr");
    let of_atlas = "--set atlas_resolution=32 --set map_resolution=16";
    let own = if method == "surface-shadow-maps" { of_atlas } else { "--elements 1500" };
    let line =
        format!("render {scene} --method {method} --display final-gather --diffuse --validate {own} {options} -o");
    let mut program = Command::new(env!("CARGO_BIN_EXE_linklight"));
    let program = program.env_remove("RUST_LOG").stdin(Stdio::null()).args(line.split(' ')).arg(&exr);
    let output = program.output().unwrap();
    assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    read(&exr).unwrap()
}

fn mean(picture: &Picture) -> DVec3 {
    picture.rgb.iter().map(|rgb| rgb.as_dvec3()).sum::<DVec3>() / picture.rgb.len() as f64
}

/// A closed room of albedo 1/2 that emits 1: with two bounces 1 + 1/2 + 1/4 + 1/8.                    [common ground]
#[test]
fn the_furnace_of_every_method_is_even() {
    let folder = tempfile::tempdir().unwrap();
    for method in METHODS {
        let picture = gathered(folder.path(), "builtin:furnace", method, "--bounces 2 --size 16x12 --spp 2");
        let even = mean(&picture).x;
        let bumps = picture.rgb.iter().map(|rgb| (f64::from(rgb.x) / even - 1.0).powi(2)).sum::<f64>();
        let bumps = (bumps / picture.rgb.len() as f64).sqrt();
        println!("{method}: {even:.4} for 1.875, uneven by {:.2} %", 100.0 * bumps);
        // A bounce more or less is 3 % and more.
        assert!((even / 1.875 - 1.0).abs() < 0.02 && bumps < 0.05, "{method}: {even} {bumps}");
    }
}

/// Each method's solution, gathered, comes near the reference; that of one bounce less does not.
#[test]
fn the_box_of_every_method_is_that_of_the_reference() {
    let folder = tempfile::tempdir().unwrap();
    let exr = folder.path().join("reference.exr");
    // Without the lamp: a picture this small has too few samples of its edges.
    let line = "render builtin:cornell-box --method path-tracing --diffuse --indirect-only --bounces 2 --size 32x32 --spp 256 -o";
    let mut program = Command::new(env!("CARGO_BIN_EXE_linklight"));
    let output = program.stdin(Stdio::null()).args(line.split(' ')).arg(&exr).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let reference = read(&exr).unwrap();
    // Of blocks of four by four pixels: what is left of the noise of both counts little.
    let blocks = |picture: &Picture| -> Vec<DVec3> {
        let mut blocks = vec![DVec3::ZERO; 64];
        for (at, rgb) in picture.rgb.iter().enumerate() {
            blocks[at / 128 * 8 + at % 32 / 4] += rgb.as_dvec3() / 16.0;
        }
        blocks
    };
    let off = |picture: &Picture| {
        let (ours, theirs) = (blocks(picture), blocks(&reference));
        let relative = ours.iter().zip(&theirs).map(|(a, b)| (*a - *b).length() / b.length().max(0.05));
        relative.sum::<f64>() / 64.0
    };
    for method in METHODS {
        let show = |bounces: u32| {
            let options = format!("--indirect-only --bounces {bounces} --size 32x32 --spp 2");
            gathered(folder.path(), "builtin:cornell-box", method, &options)
        };
        let whole = show(2);
        let energy = mean(&whole).element_sum() / mean(&reference).element_sum();
        println!("{method}: blocks off by {:.3}, energy {energy:.3}", off(&whole));
        assert!(off(&whole) < 0.12 && (energy - 1.0).abs() < 0.05, "{method}: {} {energy}", off(&whole));
        if method == METHODS[0] {
            assert!(off(&show(1)) > 0.2, "a bounce less would go unnoticed");
        }
    }
}
