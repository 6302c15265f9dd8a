//! The viewer's window on a display nobody sees, driven by mouse and keys.

use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// How long the window may take for one picture; pipelines are compiled meanwhile.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// A display nobody sees.
pub struct Screen {
    server: Child,
    pub name: String,
}

impl Screen {
    /// `None`, and said, where a tool is missing.
    pub fn start() -> Option<Self> {
        for (tool, package) in [("Xvfb", "xvfb"), ("xdotool", "xdotool"), ("xwd", "x11-apps")] {
            let folders = std::env::var_os("PATH").unwrap_or_default();
            if !std::env::split_paths(&folders).any(|folder| folder.join(tool).is_file()) {
                println!("skipped: {tool} is not installed (package {package}; tools/setup --test installs it)");
                return None;
            }
        }
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "800x600x24", "-nolisten", "tcp", "-noreset"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut number = String::new();
        BufReader::new(server.stdout.take().unwrap()).read_line(&mut number).unwrap();
        Some(Self { server, name: format!(":{}", number.trim()) })
    }

    fn tool(&self, name: &str, options: &str) -> Output {
        Command::new(name).args(options.split_whitespace()).env("DISPLAY", &self.name).output().unwrap()
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// A running viewer and its window.
pub struct View<'s> {
    screen: &'s Screen,
    program: Option<Child>,
    pub window: String,
    folder: PathBuf,
}

impl<'s> View<'s> {
    pub fn open(screen: &'s Screen, folder: &Path, options: &str) -> Self {
        Self::open_with(screen, folder, &format!("--validate {options}"), &[])
    }

    pub fn open_with(screen: &'s Screen, folder: &Path, options: &str, environment: &[(&str, String)]) -> Self {
        let program = Command::new(env!("CARGO_BIN_EXE_linklight"))
            .args(["view", "--shots"])
            .arg(folder)
            .args(options.split_whitespace())
            .env("DISPLAY", &screen.name)
            .env_remove("WAYLAND_DISPLAY")
            .envs(environment.iter().map(|(name, value)| (name, value)))
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut view = Self { screen, program: Some(program), window: String::new(), folder: folder.to_owned() };
        view.wait("a window", |view| {
            let found = view.screen.tool("xdotool", "search --name ^linklight");
            view.window = String::from_utf8_lossy(&found.stdout).lines().next().unwrap_or_default().to_owned();
            !view.window.is_empty()
        });
        view.xdotool(&format!("windowfocus {}", view.window));
        view.settle();
        view
    }

    pub fn xdotool(&self, options: &str) {
        let output = self.screen.tool("xdotool", options);
        assert!(output.status.success(), "xdotool {options}: {}", String::from_utf8_lossy(&output.stderr));
    }

    /// Until `is_so`, or the patience ends.
    pub fn wait(&mut self, what: &str, mut is_so: impl FnMut(&mut Self) -> bool) {
        let start = Instant::now();
        while !is_so(self) {
            let ended = self.program.as_mut().and_then(|program| program.try_wait().unwrap());
            assert!(ended.is_none(), "the viewer ended while waiting for {what}: {ended:?}\n{}", self.end());
            assert!(start.elapsed() < PATIENCE, "no {what} after {PATIENCE:?}; title {:?}", self.title());
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    pub fn title(&self) -> String {
        let output = self.screen.tool("xdotool", &format!("getwindowname {}", self.window));
        String::from_utf8_lossy(&output.stdout).trim().to_owned()
    }

    /// Until the picture is the one that the options decide. What was just done takes a moment to arrive.
    pub fn settle(&mut self) {
        std::thread::sleep(Duration::from_millis(150));
        self.wait("finished picture", |view| view.title().contains("(ready"));
    }

    pub fn key(&mut self, key: &str) {
        self.xdotool(&format!("key {key}"));
        self.settle();
    }

    pub fn drag(&mut self, button: u32, from: [i32; 2], to: [i32; 2]) {
        let [x, y] = from;
        self.xdotool(&format!("mousemove {x} {y} mousedown {button}"));
        // In steps, as a hand does.
        for step in 1..=4 {
            let at = |axis: usize| from[axis] + (to[axis] - from[axis]) * step / 4;
            self.xdotool(&format!("mousemove {} {}", at(0), at(1)));
            std::thread::sleep(Duration::from_millis(30));
        }
        self.xdotool(&format!("mouseup {button}"));
        self.settle();
    }

    /// Takes a screenshot and returns its name without ending.
    pub fn shoot(&mut self, number: u32) -> PathBuf {
        let name = self.folder.join(format!("shot-{number:03}"));
        self.xdotool("key F12");
        let written = name.with_extension("exr");
        self.wait("screenshot", |_| written.exists());
        name
    }

    /// What it said until it ended.
    fn end(&mut self) -> String {
        let Some(mut program) = self.program.take() else { return String::new() };
        let _ = program.kill();
        String::from_utf8_lossy(&program.wait_with_output().unwrap().stderr).into_owned()
    }

    /// Closes it as a user does; it must end well, and validation must have been silent. Returns what it said.
    pub fn close(mut self) -> String {
        self.xdotool("key ctrl+q");
        let start = Instant::now();
        let mut program = self.program.take().unwrap();
        while program.try_wait().unwrap().is_none() && start.elapsed() < PATIENCE {
            std::thread::sleep(Duration::from_millis(20));
        }
        let _ = program.kill();
        let output = program.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{}\n{said}", output.status);
        said
    }
}

impl Drop for View<'_> {
    fn drop(&mut self) {
        let said = self.end();
        if std::thread::panicking() {
            eprintln!("{said}");
        }
    }
}

/// What the screen shows, RGB rows from the top, and its width and height.
pub fn screen(view: &View<'_>) -> (u32, u32, Vec<u8>) {
    let dump = view.screen.tool("xwd", &format!("-silent -id {}", view.window)).stdout;
    // X Window Dump 7: big-endian words, a colour map, then rows of B G R x.
    let word = |i: usize| u32::from_be_bytes([dump[4 * i], dump[4 * i + 1], dump[4 * i + 2], dump[4 * i + 3]]);
    let (header, width, height, row_bytes, colors) = (word(0), word(4), word(5), word(12), word(19));
    assert_eq!((word(1), word(11)), (7, 32), "an X Window Dump 7 of 32 bits a pixel");
    let first = (header + 12 * colors) as usize;
    let rows = dump[first..].chunks(row_bytes as usize).take(height as usize);
    let rgb = rows.flat_map(|row| row[..4 * width as usize].chunks(4).flat_map(|p| [p[2], p[1], p[0]])).collect();
    (width, height, rgb)
}

/// `linklight render --state` of a screenshot, at `name`.headless.png.
pub fn headless(name: &Path, options: &str) -> PathBuf {
    let picture = name.with_extension("headless.png");
    let output = Command::new(env!("CARGO_BIN_EXE_linklight"))
        .args(["render", "--quiet", "--state"])
        .arg(name.with_extension("state"))
        .arg("-o")
        .arg(&picture)
        .args(options.split_whitespace())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    picture
}

/// Holds picture `a` to `b` by `linklight diff`; true where FLIP stays within 0.01.
pub fn looks_alike(a: &Path, b: &Path) -> bool {
    let mut diff = Command::new(env!("CARGO_BIN_EXE_linklight"));
    diff.arg("diff").args([a, b]).args(["--fail-above", "flip=0.01"]).output().unwrap().status.success()
}

pub fn rgb(path: &Path) -> image::RgbImage {
    image::open(path).unwrap().to_rgb8()
}

pub const SMALL: &str =
    "builtin:cornell-box --bare --size 160x120 --elements 500 --bounces 1 --set rays_per_element=64";

pub const TINY: &str =
    "builtin:cornell-box --bare --size 160x120 --elements 300 --bounces 1 --spp 2 --set smoothing=false";
