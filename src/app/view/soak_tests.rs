//! Long work with random edits: pictures stay those of a new engine, and memory stays what it was.
//!
//! `LINKLIGHT_SOAK_FRAMES=10000 LINKLIGHT_SOAK_SCENES=dancer,tea-room LINKLIGHT_SOAK_SEED=7 cargo test --release --lib soak
//! -- --nocapture` is the long form; methods by LINKLIGHT_SOAK_METHODS. What makes frames short: LINKLIGHT_SOAK_CELL=0.25
//! for coarse copies of the scenes, with a vertex for each so many metres, and LINKLIGHT_SOAK_ELEMENTS=300 for methods with
//! elements. LINKLIGHT_SOAK_PASSES=20 lists the passes that took longest; LINKLIGHT_SOAK_UNVALIDATED=1 leaves the layer
//! away, whose own memory grows. With `LINKLIGHT_SOAK_ASSISTED=1` validation looks at every access of every shader (its
//! instrumented shaders take a minute a method to compile): none reaches beyond what is bound.

use std::collections::BTreeMap;
use std::time::Instant;

use super::soak_scenes::coarse_file;
use super::tests::try_pixels;
use super::*;
use crate::gpu::Options;
use crate::methods::settings::Kind;
use crate::methods::{METHODS, Method};

/// Small enough for every method, and enough for what its settings cost.
const SMALL: [(&str, &str); 4] = [
    (
        "surface-shadow-maps",
        "--set atlas_resolution=40 --set map_resolution=8 --set keep_maps=false --set light_samples=2",
    ),
    ("explicit-visibility", "--set rays_per_element=64"),
    ("implicit-visibility", "--set bins=4"),
    ("face-cluster", "--set threshold=0.004"),
];

/// SplitMix64.
struct Random(u64);

impl Random {
    fn below(&mut self, count: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % count
    }

    /// In steps of a hundredth, 0 to 1.
    fn share(&mut self) -> f64 {
        self.below(101) as f64 / 100.0
    }
}

/// What a user may have asked for so far.
#[derive(Clone, Default)]
struct State {
    seconds: f64,
    bounces: u64,
    size: u64,
    eye: Option<[f64; 3]>,
    albedo: Option<[f64; 3]>,
    intensity: Option<f64>,
    roughness: Option<f64>,
    moved: Option<f64>,
    setting: Option<(&'static str, &'static str)>,
    display: Option<&'static str>,
}

impl State {
    /// One of them changes; what is made anew from the ground rarely.
    fn change(&mut self, random: &mut Random, has_lights: bool, settings: &[(&'static str, &'static str)]) {
        match random.below(24) {
            0..6 => self.seconds = 4.0 * random.share(),
            6..9 => self.albedo = Some([random.share(), random.share(), random.share()]),
            9..12 if has_lights => self.intensity = Some(2.0 * random.share()),
            12..15 => self.eye = Some([random.share() - 0.5, 0.8 + random.share(), 1.0 + random.share()]),
            15..17 => self.bounces = random.below(4),
            17 => self.size = random.below(2),
            18 => self.roughness = Some(random.share()),
            19 => self.moved = Some(random.share() / 10.0),
            20..22 => self.setting = settings.get(random.below(1 + settings.len() as u64) as usize).copied(),
            22 => self.display = [None, Some("vertex"), Some("final-gather")][random.below(3) as usize],
            _ => *self = Self::default(),
        }
    }

    fn options(&self) -> String {
        let size = ["30x20", "20x30"][self.size as usize];
        let mut options = format!("--seconds {} --bounces {} --size {size}", self.seconds, self.bounces);
        if let Some([x, y, z]) = self.eye {
            options += &format!(" --eye {x},{y},{z} --look-at 0,0.7,0");
        }
        if let Some([r, g, b]) = self.albedo {
            options += &format!(" --edit material:1.albedo={r},{g},{b}");
        }
        if let Some(intensity) = self.intensity {
            options += &format!(" --edit light:0.intensity={intensity}");
        }
        if let Some(roughness) = self.roughness {
            options += &format!(" --edit material:0.roughness={roughness}");
        }
        if let Some(moved) = self.moved {
            options += &format!(" --edit node:6.move={moved},0,0");
        }
        if let Some((key, value)) = self.setting {
            options += &format!(" --set {key}={value}");
        }
        if let Some(display) = self.display {
            options += &format!(" --display {display}");
        }
        options
    }
}

/// What a method's switches and choices may be set to.
fn settings_of(method: &Method) -> Vec<(&'static str, &'static str)> {
    let specs = method.specs().into_iter();
    specs
        .flat_map(|spec| match spec.kind {
            Kind::Bool => vec![(spec.name, "false"), (spec.name, "true")],
            Kind::Choice { values } => values.iter().map(|value| (spec.name, value.name)).collect(),
            _ => Vec::new(),
        })
        .collect()
}

/// A picture's pixels, or why it is refused.
fn picture(context: &Context, engine: &mut Engine<'_>, options: &str) -> Result<Vec<Vec3>, String> {
    try_pixels(context, engine, options).map_err(|error| {
        assert!(!context.is_lost(), "{options}: {error}");
        error.to_string()
    })
}

fn variable(name: &str) -> Option<String> {
    std::env::var(name).ok().filter(|text| !text.is_empty())
}

/// Bytes on the device that no picture asked for explains: those that stand when the first picture is asked for again.
fn bytes(context: &Context) -> u64 {
    context.memory_by_owner().values().map(|used| used.current_bytes).sum()
}

/// Bytes of this process in memory, MiB, where the system tells.
fn resident() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let kibibytes = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?.trim().strip_suffix(" kB")?;
    kibibytes.parse::<u64>().ok().map(|kibibytes| kibibytes / 1024)
}

#[test]
fn random_edits_leave_pictures_and_memory_as_they_were() {
    let frames: u64 = variable("LINKLIGHT_SOAK_FRAMES").map_or(12, |text| text.parse().unwrap());
    let seed: u64 = variable("LINKLIGHT_SOAK_SEED").map_or(1, |text| text.parse().unwrap());
    let scenes = variable("LINKLIGHT_SOAK_SCENES").unwrap_or_else(|| "cornell-box".into());
    let methods = variable("LINKLIGHT_SOAK_METHODS");
    let asked: Vec<&str> = methods.iter().flat_map(|list| list.split(',')).collect();
    let unknown = asked.iter().find(|name| METHODS.iter().all(|method| method.key != **name));
    assert_eq!(unknown, None, "LINKLIGHT_SOAK_METHODS: no method has this name");
    assert!(frames > 1, "LINKLIGHT_SOAK_FRAMES={frames}: memory is compared between halves, so two at least");
    let chosen = |key: &str| asked.is_empty() || asked.contains(&key);
    let folder = tempfile::tempdir().unwrap();
    for name in scenes.split(',') {
        let mut scene = format!("builtin:{name}");
        if let Some(cell) = variable("LINKLIGHT_SOAK_CELL") {
            scene = coarse_file(folder.path(), name, cell.parse().unwrap()).display().to_string();
        }
        for method in METHODS.iter().filter(|method| chosen(method.key)) {
            soak(&scene, method, frames, seed);
        }
    }
}

fn soak(scene: &str, method: &Method, frames: u64, seed: u64) {
    let (choices, method) = (settings_of(method), method.key);
    let gpu_assisted = variable("LINKLIGHT_SOAK_ASSISTED").is_some();
    let validation = variable("LINKLIGHT_SOAK_UNVALIDATED").is_none();
    let context = Context::new(Options { validation, gpu_assisted, ..Options::default() }).unwrap();
    let settings = SMALL.iter().find(|(key, _)| *key == method).map_or("", |(_, settings)| settings);
    // The tea room has 1,746 charts.
    let atlas = if scene.contains("tea-room") { "atlas_resolution=64" } else { "atlas_resolution=40" };
    let settings = settings.replace("atlas_resolution=40", atlas);
    let elements = variable("LINKLIGHT_SOAK_ELEMENTS")
        .filter(|_| !["path-tracing", "surface-shadow-maps", "face-cluster"].contains(&method))
        .map_or(String::new(), |count| format!("--elements {count}"));
    let asked = |state: &State| format!("{scene} --method {method} {elements} {settings} {}", state.options());
    let mut engine = Engine::new(&context);
    let (mut state, mut random) = (State { bounces: 1, ..State::default() }, Random(seed));
    let first_state = state.clone();
    let is_long = variable("LINKLIGHT_SOAK_FRAMES").is_some();
    let first = picture(&context, &mut engine, &asked(&state));
    assert!(first.is_ok(), "{scene} {method}: {first:?}");
    let mut refused = 0;
    let has_lights = !engine.stage().unwrap().pose.lights.is_empty();
    let (mut levels, mut host, start) = (Vec::new(), Vec::new(), Instant::now());
    let mut times = BTreeMap::<&str, u64>::new();
    let every = if frames < 400 { (frames / 4).max(1) } else { frames / 100 };
    for frame in 1..=frames {
        state.change(&mut random, has_lights, &choices);
        let options = asked(&state);
        let pixels = picture(&context, &mut engine, &options);
        match &pixels {
            Ok(pixels) => assert!(pixels.iter().all(|p| p.is_finite()), "{options}: not finite in frame {frame}"),
            Err(_) => refused += 1,
        }
        // As the window does.
        for record in context.take_records() {
            *times.entry(record.name).or_default() += record.end_ns.saturating_sub(record.start_ns);
        }
        if frame % every == 0 {
            let fresh = picture(&context, &mut Engine::new(&context), &options);
            assert!(pixels == fresh, "{options}: frame {frame} of seed {seed} is not a new engine's");
            let back = picture(&context, &mut engine, &asked(&first_state));
            assert!(back == first, "{options}: frame {frame} of seed {seed}, then back");
            levels.push(bytes(&context));
            host.extend(resident());
            if is_long {
                println!(
                    "{scene} {method}: {frame} frames in {:.0?}, {} bytes at rest",
                    start.elapsed(),
                    bytes(&context)
                );
            }
        }
    }
    println!(
        "{scene} {method}: {frames} frames ({refused} refused) in {:.0?}, bytes at rest {levels:?}, MiB of the process {host:?}",
        start.elapsed()
    );
    let mut times: Vec<_> = times.into_iter().collect();
    times.sort_by_key(|(_, nanoseconds)| std::cmp::Reverse(*nanoseconds));
    let listed = variable("LINKLIGHT_SOAK_PASSES").map_or(0, |text| text.parse().unwrap());
    for (name, nanoseconds) in times.into_iter().take(listed) {
        println!("{:8.2} ms a frame: {name}", nanoseconds as f64 / 1e6 / frames as f64);
    }
    // What is kept for further use grows to what the poses need at most, which long work has met in its first half.
    let (early, late) = levels.split_at(levels.len() / 2);
    let (early, late) = (early.iter().max().unwrap(), late.iter().max().unwrap());
    let allowed = if is_long { early + early / 100 } else { *early };
    assert!(*late <= allowed, "{scene} {method}: memory grows: {levels:?}");
    // What the allocator keeps varies a little; other tests of the process make it vary more. The layer keeps the names of
    // what is gone: 3 kB a frame.
    let allowed = if validation { 48 } else { 8 };
    let (early, late) = host.split_at(host.len() / 2);
    let grows = is_long && late.iter().max() > early.iter().max().map(|most| most + allowed).as_ref();
    assert!(!grows, "{scene} {method}: the process grows: {host:?} MiB");
    // The layer says first what it switches on for itself.
    let is_setting = |m: &String| m.contains("layer settings provided") || m.contains("is adjusting settings");
    let said: Vec<String> = context.validation_messages().into_iter().filter(|m| !is_setting(m)).collect();
    assert_eq!(said, [""; 0], "{scene} {method}");
}

/// Hierarchies that were refitted hold triangles in another order than new ones; what maps hold must not depend on it.
#[test]
fn maps_of_a_later_pose_are_those_of_a_new_engine() {
    let folder = tempfile::tempdir().unwrap();
    let file = coarse_file(folder.path(), "dancer", 0.6);
    let context = Context::new(Options { validation: true, ..Options::default() }).unwrap();
    let (_, settings) = SMALL[0];
    let asked = |seconds: f32| {
        let scene = file.display();
        format!("{scene} --method surface-shadow-maps {settings} --bounces 2 --size 30x20 --seconds {seconds}")
    };
    let mut engine = Engine::new(&context);
    let first = picture(&context, &mut engine, &asked(0.0)).unwrap();
    let later = picture(&context, &mut engine, &asked(1.04)).unwrap();
    assert!(later == picture(&context, &mut Engine::new(&context), &asked(1.04)).unwrap());
    assert!(later != first);
    assert_eq!(context.validation_messages(), [""; 0]);
}
