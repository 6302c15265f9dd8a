//! `linklight view` in a window of its own: driven by mouse and keys as by a user, looked at from outside.
//!
//! Needs Xvfb, xdotool and xwd; where one is missing only that is said.

mod captures;
mod window;

use std::path::Path;
use std::process::Command;
use std::time::Duration;
use window::{SMALL, Screen, TINY, View, headless, looks_alike, rgb, screen};

/// SplitMix64.
struct Random(u64);

impl Random {
    fn below(&mut self, bound: u64) -> i32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % bound) as i32
    }
}

#[test]
fn another_method_stands_beside_the_picture_and_differences_are_shown() {
    let Some(screen_server) = Screen::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    // Links by two devices are those of one.
    let options = format!("{SMALL} --against path-tracing --link-gpu 0");
    let mut view = View::open(&screen_server, folder.path(), &options);
    let figure = |title: &str| -> Option<(f64, u32)> {
        let (_, rest) = title.split_once("relative MSE ")?;
        let (figure, rest) = rest.split_once(" to path-tracing of ")?;
        Some((figure.parse().ok()?, rest.trim_end_matches(')').parse().ok()?))
    };
    view.wait("a finer reference", |view| figure(&view.title()).is_some_and(|(_, spp)| spp >= 32));
    let (error, _) = figure(&view.title()).unwrap();
    assert!(error > 0.0 && error < 0.5, "relative MSE {error}");
    let (width, height, pixels) = screen(&view);
    assert_eq!((width, height), (320, 120), "two pictures side by side");
    if let Ok(kept) = std::env::var("LINKLIGHT_KEEP_SHOTS") {
        let path = Path::new(&kept).join("side-by-side.png");
        image::save_buffer(path, &pixels, width, height, image::ColorType::Rgb8).unwrap();
    }
    // Both halves show the room, one of them noisy.
    let half = |first: u32| -> Vec<f64> {
        let rows = (0..height).flat_map(|y| (first..first + 160).map(move |x| (y * 320 + x) as usize));
        rows.map(|at| f64::from(pixels[3 * at + 1])).collect()
    };
    let (left, right) = (half(0), half(160));
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let off = left.iter().zip(&right).map(|(a, b)| (a - b).abs()).sum::<f64>() / left.len() as f64;
    let (ours, theirs) = (mean(&left), mean(&right));
    assert!(ours > 30.0 && (ours / theirs - 1.0).abs() < 0.2, "{ours} beside {theirs}");
    assert!(off > 0.1 && off < 25.0, "pixels differ by {off}");
    let shot = view.shoot(1);
    let said = view.close();
    assert!(said.contains("made by devices in runs of ["), "{said}");
    // What is written is the picture itself.
    assert_eq!(rgb(&shot.with_extension("png")), rgb(&headless(&shot, "")));
}

#[test]
fn a_gpu_that_is_lost_closes_the_window_and_says_where() {
    let Some(screen_server) = Screen::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("crash.json");
    let lost = Command::new(env!("CARGO_BIN_EXE_linklight"))
        .args(["view", "--validate", "--lose-device-at", "display/vertex", "--crash-file"])
        .arg(&file)
        .args(TINY.split_whitespace())
        .env("DISPLAY", &screen_server.name)
        .env_remove("WAYLAND_DISPLAY")
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&lost.stderr);
    assert_eq!(lost.status.code(), Some(1), "{said}");
    assert!(said.contains("the device was lost in") && said.contains("display/vertex"), "{said}");
    let crash = std::fs::read_to_string(&file).unwrap();
    assert!(crash.contains("linklight render builtin:cornell-box --method=explicit-visibility"), "{crash}");
}

/// Counts that F5 makes the viewer say: frames, pipelines, bytes on the device; one line each time.
fn counts(said: &str) -> Vec<[u64; 3]> {
    let lines = said.lines().filter(|line| line.contains("frames shown"));
    lines
        .map(|line| {
            let numbers: Vec<u64> =
                line.split(|c: char| !c.is_ascii_digit() && c != '.').filter_map(|word| word.parse().ok()).collect();
            numbers[numbers.len() - 3..].try_into().unwrap()
        })
        .collect()
}

/// Actions of [`nothing_done_at_random_leaves_a_trace`]; LINKLIGHT_ACTIONS=200 for a longer drive.
const ACTIONS: &str = "24";

#[test]
fn the_window_shows_what_a_headless_render_of_its_state_shows() {
    let Some(screen_server) = Screen::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut view = View::open(&screen_server, folder.path(), SMALL);
    let first = view.shoot(1);

    // Another view, another exposure of another size, another method, and without a surface for a moment.
    view.drag(1, [60, 60], [90, 50]);
    view.drag(3, [60, 60], [64, 70]);
    view.xdotool("mousemove 80 60 click 4");
    view.settle();
    let turned = view.shoot(2);
    assert!(!looks_alike(&first.with_extension("png"), &turned.with_extension("png")), "the camera has moved");
    view.xdotool(&format!("windowsize --sync {} 200 100", view.window));
    view.settle();
    view.key("Next");
    view.key("ctrl+l");
    let other = view.shoot(3);
    assert!(std::fs::read_to_string(other.with_extension("state")).unwrap().contains("--size=200x100"));

    let (width, height, pixels) = screen(&view);
    let grabbed = folder.path().join("screen.png");
    image::save_buffer(&grabbed, &pixels, width, height, image::ColorType::Rgb8).unwrap();
    let said = view.close();
    assert!(said.contains("frames shown"), "{said}");

    for name in [&first, &turned, &other] {
        let headless = headless(name, "");
        assert_eq!(rgb(&name.with_extension("png")), rgb(&headless), "the same pixels for {}", name.display());
    }
    assert!(looks_alike(&grabbed, &headless(&other, "")), "the screen shows it too: {}", grabbed.display());
    assert!(!looks_alike(&headless(&other, "--exposure=0.5"), &grabbed), "half a stop is seen");
}

#[test]
fn nothing_done_at_random_leaves_a_trace() {
    let Some(screen_server) = Screen::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut view = View::open(&screen_server, folder.path(), TINY);
    let save = |view: &mut View<'_>, number: u32| {
        view.settle();
        view.xdotool("key F5");
        let written = folder.path().join(format!("shot-{number:03}.state"));
        view.wait("state", |_| written.exists());
        std::fs::read_to_string(written).unwrap()
    };
    // Through the methods, so that whatever is made once is there: path-tracing stands before the first, two more
    // behind it. The others take seconds to prepare.
    for key in ["Next", "Next", "Prior", "Prior", "Prior", "Next"] {
        view.key(key);
    }
    let before = save(&mut view, 1);
    let actions: usize = std::env::var("LINKLIGHT_ACTIONS").as_deref().unwrap_or(ACTIONS).parse().unwrap();
    let mut random = Random(7);
    let (mut method, mut hidden) = (0, true);
    for _ in 0..actions {
        let (x, y) = (20 + random.below(100), 20 + random.below(60));
        let window = view.window.clone();
        // Keys go to the window that has the focus; without a window manager one that was away has it not.
        let press = |key: &str| view.xdotool(&format!("windowfocus --sync {window} key {key}"));
        match random.below(11) {
            0 if method < 2 => {
                press("Next");
                method += 1;
            }
            1 if method > -1 => {
                press("Prior");
                method -= 1;
            }
            2 => view.xdotool(&format!("windowsize {window} {} {}", 100 + x, 50 + y)),
            3 => {
                press("F1");
                hidden = !hidden;
            }
            4 => press("ctrl+l"),
            5 => press("Escape"),
            // The panel fills so small a window: a click in it may change anything.
            0 | 1 | 7.. if !hidden => {
                press("F1");
                hidden = true;
            }
            6 => view
                .xdotool(&format!("windowunmap --sync {window} windowmap --sync {window} windowfocus --sync {window}")),
            7 => view.xdotool(&format!("mousemove {x} {y} click 4")),
            8 => view.xdotool(&format!("mousemove {x} {y} click 1")),
            // What was picked moves.
            9 => view.xdotool(&format!(
                "mousemove {x} {y} click 1 sleep 0.2 keydown shift mousedown 1 mousemove {} {y} sleep 0.1 mouseup 1 \
                 keyup shift",
                x + random.below(9)
            )),
            _ => view.xdotool(&format!(
                "mousemove {x} {y} mousedown 1 mousemove {} {y} mousemove {y} {x} mouseup 1",
                x + random.below(30)
            )),
        }
        std::thread::sleep(Duration::from_millis(random.below(200) as u64));
    }
    // Back to where it began. What Escape cancelled is asked for again by the changes.
    let window = view.window.clone();
    view.xdotool(&format!("windowfocus --sync {window}"));
    if !hidden {
        view.xdotool("key F1");
    }
    view.xdotool(&format!("windowsize --sync {window} 150 110 key r"));
    while method != 0 {
        view.key(if method < 0 { "Next" } else { "Prior" });
        method -= i32::signum(method);
    }
    view.xdotool(&format!("windowsize --sync {window} 160 120"));
    let after = save(&mut view, 2);
    let option = |state: &str, name: &str| {
        state.lines().find(|line| line.starts_with(name)).map(str::to_owned).unwrap_or_default()
    };
    for name in ["--method=", "--size=", "--bounces=", "--set="] {
        assert_eq!(option(&after, name), option(&before, name));
    }
    let name = view.shoot(3);
    let said = view.close();
    let counts = counts(&said);
    let ([_, pipelines, bytes], [frames, later_pipelines, later_bytes]) = (counts[0], counts[1]);
    assert_eq!(later_pipelines, pipelines, "no pipeline is made once all were");
    let grown = later_bytes as f64 / bytes as f64;
    assert!(grown < 1.05, "memory grew from {bytes} to {later_bytes} bytes in {frames} frames");
    assert_eq!(rgb(&name.with_extension("png")), rgb(&headless(&name, "")));
}
