//! What a run on a device leaves behind: a picture with its metadata, a profile, a trace and a table, all readable.

mod common;

use clap::Parser as _;
use common::TestContext;
use glam::Vec3;
use linklight::app::cli::{Cli, Command};
use linklight::app::output::{Measured, write_measurements, write_picture};
use linklight::app::render::RenderRequest;
use linklight::report::image::{self, Picture};
use linklight::report::profile::{Profile, SceneFacts};
use linklight::report::trace::TimeLine;
use linklight::stages::scan;
use serde_json::Value;
use std::path::Path;

fn request(folder: &Path, output: &str) -> RenderRequest {
    let in_folder = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let (output, profile, trace) = (in_folder(output), in_folder("p.json"), in_folder("t.json"));
    let line = ["linklight", "render", "builtin:furnace", "-o", &output, "--profile", &profile, "--trace", &trace];
    let Command::Render(args) = Cli::try_parse_from(line).unwrap().command else { panic!("not a render") };
    RenderRequest::try_from(*args).unwrap()
}

#[test]
fn profile_trace_and_table_agree_about_a_frame() {
    let folder = tempfile::tempdir().unwrap();
    let request = request(folder.path(), "a.exr");
    let context = TestContext::new();
    let time_line = TimeLine::default();
    let len = 300_000;
    let values = context.upload("scene/values", &vec![1u32; len]).unwrap();
    let scratch = scan::ScanScratch::new(&context, "scan", len).unwrap();
    context.take_records();
    time_line.span("solve", || {
        let mut recorder = context.recorder("frame").unwrap();
        recorder.scope("offsets", |recorder| scan::exclusive(recorder, &values, len, &scratch));
        recorder.submit().unwrap();
    });
    let records = context.take_records();
    let (count, first_path) = (records.len() as u64, records[0].path.clone());

    let scene = SceneFacts { name: "furnace".into(), triangles: 12, elements: 8, lights: 0 };
    let mut table = Vec::new();
    let measured = Measured {
        context: &context,
        time_line: &time_line,
        records,
        scene,
        method: serde_json::json!({"transfers": 7}),
    };
    write_measurements(&request, measured, &mut table).unwrap();

    let profile = Profile::read(&folder.path().join("p.json")).unwrap();
    assert_eq!(profile.passes.iter().map(|pass| pass.calls).sum::<u64>(), count);
    assert_eq!(profile.passes[0].path, first_path);
    assert!(first_path.starts_with("frame/offsets/"), "{first_path}");
    assert_eq!((&profile.settings["bounces"], profile.scene.triangles), (&4.into(), 12));
    assert!(profile.passes.iter().all(|pass| pass.bytes_read > 0 && pass.ms.total > 0.0), "{:?}", profile.passes);
    assert_eq!(profile.method["transfers"], 7);
    let owners: Vec<&str> = profile.memory.owners.iter().map(|owner| owner.owner.as_str()).collect();
    assert!(owners.contains(&"scene") && owners.contains(&"scan"), "{owners:?}");
    assert!(profile.memory.peak_bytes >= 4 * len as u64);

    let table = String::from_utf8(table).unwrap();
    assert!(table.contains(&first_path) && table.contains("\nsum "), "{table}");

    let trace: Value = serde_json::from_str(&std::fs::read_to_string(folder.path().join("t.json")).unwrap()).unwrap();
    let events = trace["traceEvents"].as_array().unwrap();
    let bar = |name: &str| {
        let event = events.iter().find(|event| event["ph"] == "X" && event["name"] == name);
        let event = event.unwrap_or_else(|| panic!("no {name} in {trace}"));
        (event["ts"].as_f64().unwrap(), event["dur"].as_f64().unwrap())
    };
    let (solve, frame, offsets) = (bar("solve"), bar("frame"), bar("offsets"));
    assert!(frame.0 <= offsets.0 && offsets.0 + offsets.1 <= frame.0 + frame.1 + 1e-3);
    if context.features().calibrated_timestamps {
        // The device worked while the host waited, up to what the clocks may be off.
        let slack = 1000.0;
        assert!(solve.0 - slack <= frame.0 && frame.0 + frame.1 <= solve.0 + solve.1 + slack, "{solve:?} {frame:?}");
    }
}

#[test]
fn pictures_say_how_they_were_made() {
    let folder = tempfile::tempdir().unwrap();
    let context = TestContext::new();
    for name in ["a.exr", "a.png"] {
        let request = request(folder.path(), name);
        let picture = Picture::new(4, 2, vec![Vec3::new(0.5, 1.0, 2.0); 8]).unwrap();
        write_picture(&request, picture, context.info()).unwrap();
        let read = image::read(&folder.path().join(name)).unwrap();
        assert_eq!(read.metadata["scene"], "builtin:furnace");
        assert!(read.metadata["device"].starts_with(&context.info().name));
        let settings: Value = serde_json::from_str(&read.metadata["settings"]).unwrap();
        assert_eq!(settings["method"], "explicit-visibility");
        assert_eq!(settings["settings"]["rays_per_element"], 256);
        assert_eq!(settings.get("exposure").is_some(), name == "a.png");
    }
}
