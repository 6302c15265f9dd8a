//! Captures taken from the window, by RenderDoc and GFXReconstruct.

use crate::window::{Screen, TINY, View, rgb};
use std::path::{Path, PathBuf};
use std::process::Command;

#[test]
fn a_capture_from_the_window_holds_the_frame_that_was_asked_for_in_words() {
    let Some(screen_server) = Screen::start() else { return };
    if Command::new("renderdoccmd").arg("--version").output().is_err() {
        return println!("skipped: renderdoccmd is not installed (package renderdoc)");
    }
    let folder = tempfile::tempdir().unwrap();
    let in_folder = |name: &str| folder.path().join(name);
    // The first in full quality is made again when its links are there; a picture that is named comes with all of it.
    for (options, has_links) in [("", false), ("--capture-frame 1", true)] {
        let (file, xml) = (in_folder("frame.rdc"), in_folder("frame.xml"));
        let (profile, trace) = (in_folder("a.json"), in_folder("a.trace.json"));
        let measured = format!("--profile {} --trace {}", profile.display(), trace.display());
        let all = format!("{TINY} {options} {measured} --capture {}", file.display());
        let mut view = View::open(&screen_server, folder.path(), &all);
        view.wait("the capture", |_| file.exists());
        view.close();
        assert!(std::fs::read(&file).unwrap().starts_with(b"RDOC"));
        let convert =
            Command::new("renderdoccmd").args(["convert", "-c", "xml", "-f"]).arg(&file).arg("-o").arg(&xml).output();
        assert!(convert.unwrap().status.success());
        let words = std::fs::read_to_string(&xml).unwrap();
        for word in ["explicit-visibility", "bounce 1", "gather/links", "display/vertex"] {
            assert!(words.contains(word), "{options}: no {word} in the capture");
        }
        assert_eq!(words.contains("links/merge_hits"), has_links, "{options}");

        // What the window measured is written when it is closed.
        let read =
            |path: &Path| -> serde_json::Value { serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap() };
        let (profile, trace) = (read(&profile), read(&trace));
        let passes = profile["passes"].as_array().unwrap();
        assert!(passes.iter().any(|pass| pass["name"] == "gather/links"), "{passes:?}");
        assert!(profile["frames"].as_u64().unwrap() >= 1 && profile["memory"]["bytes"].as_u64().unwrap() > 0);
        let events = trace["traceEvents"].as_array().unwrap();
        assert!(events.iter().any(|event| event["name"] == "picture 1"), "{events:?}");
        for name in ["frame.rdc", "frame.xml"] {
            std::fs::remove_file(in_folder(name)).unwrap();
        }
    }
}

/// A .bmp without compression, as RGB rows from the top.
fn bitmap(path: &Path) -> image::RgbImage {
    let bytes = std::fs::read(path).unwrap();
    let word = |at: usize| i32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let (first, width, rows) = (word(10) as usize, word(18) as u32, word(22));
    let (height, each) = (rows.unsigned_abs(), usize::from(bytes[28]) / 8);
    let row_bytes = (width as usize * each).next_multiple_of(4);
    image::RgbImage::from_fn(width, height, |x, y| {
        let row = if rows > 0 { height - 1 - y } else { y };
        let at = first + row as usize * row_bytes + x as usize * each;
        image::Rgb([bytes[at + 2], bytes[at + 1], bytes[at]])
    })
}

#[test]
fn what_gfxreconstruct_captured_replays_to_the_same_picture() {
    let Some(screen_server) = Screen::start() else { return };
    if Command::new("gfxrecon-replay").arg("--version").output().is_err() {
        return println!("skipped: gfxrecon-replay is not installed (package gfxreconstruct)");
    }
    let folder = tempfile::tempdir().unwrap();
    let layer = [
        ("VK_INSTANCE_LAYERS", "VK_LAYER_LUNARG_gfxreconstruct".to_owned()),
        ("GFXRECON_LOG_LEVEL", "error".to_owned()),
        ("GFXRECON_CAPTURE_FILE", folder.path().join("a.gfxr").display().to_string()),
        ("GFXRECON_CAPTURE_FILE_TIMESTAMP", "false".to_owned()),
    ];
    let mut view = View::open_with(&screen_server, folder.path(), TINY, &layer);
    let shot = view.shoot(1);
    view.close();
    let replay = Command::new("gfxrecon-replay")
        .args(["--screenshot-all", "--screenshot-dir"])
        .arg(folder.path())
        .arg(folder.path().join("a.gfxr"))
        .env("DISPLAY", &screen_server.name)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&replay.stdout) + String::from_utf8_lossy(&replay.stderr);
    assert!(replay.status.success(), "{said}");
    let number = |path: &PathBuf| -> Option<u32> {
        let name = path.file_stem()?.to_str()?.strip_prefix("screenshot_frame_")?;
        name.parse().ok()
    };
    let files = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path());
    let frames: Vec<PathBuf> = files.filter(|path| number(path).is_some()).collect();
    assert!(!frames.is_empty(), "no frame: {said}");
    let picture = rgb(&shot.with_extension("png"));
    // The driver rounds the window's bytes, we those of the file: one may be a step apart.
    let is_picture = |path: &PathBuf| {
        let frame = bitmap(path);
        frame.dimensions() == picture.dimensions() && frame.iter().zip(picture.iter()).all(|(a, b)| a.abs_diff(*b) <= 1)
    };
    // The window goes on drawing while it is closed.
    assert!(frames.iter().any(is_picture), "none of {} frames is the picture", frames.len());
    let first = frames.iter().min_by_key(|path| number(path)).unwrap();
    assert!(!is_picture(first), "frames differ: the first shows no picture yet");
}
