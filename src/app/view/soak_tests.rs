//! Long work with random edits: pictures stay those of a new engine, and memory stays what it was.
//!
//! `LINKLIGHT_SOAK_FRAMES=10000 LINKLIGHT_SOAK_SCENES=dancer,tea-room LINKLIGHT_SOAK_SEED=7 cargo test --release --lib soak
//! -- --nocapture` is the long form; methods by LINKLIGHT_SOAK_METHODS, and LINKLIGHT_SOAK_ELEMENTS=300 makes frames of methods
//! with elements short. With `LINKLIGHT_SOAK_ASSISTED=1` validation looks at every access of every shader (its instrumented
//! shaders take a minute a method to compile): none reaches beyond what is bound.

use std::time::Instant;

use super::tests::pixels;
use super::*;
use crate::gpu::Options;
use crate::methods::METHODS;

/// Small enough for every method, and enough for what its settings cost.
const SMALL: [(&str, &str); 4] = [
    (
        "surface-shadow-maps",
        "--set atlas_resolution=40 --set map_resolution=8 --set keep_maps=false --set light_samples=2",
    ),
    ("explicit-visibility", "--set rays_per_element=64"),
    ("implicit-visibility", "--set bins=8"),
    ("face-cluster", "--set threshold=0.001"),
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
}

impl State {
    /// One of them changes; what is made anew from the ground rarely.
    fn change(&mut self, random: &mut Random, has_lights: bool) {
        match random.below(20) {
            0..6 => self.seconds = 4.0 * random.share(),
            6..9 => self.albedo = Some([random.share(), random.share(), random.share()]),
            9..12 if has_lights => self.intensity = Some(2.0 * random.share()),
            12..15 => self.eye = Some([random.share() - 0.5, 0.8 + random.share(), 1.0 + random.share()]),
            15..17 => self.bounces = random.below(4),
            17 => self.size = random.below(2),
            18 => self.roughness = Some(random.share()),
            19 => self.moved = Some(random.share() / 10.0),
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
        options
    }
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
    let chosen = |key: &str| methods.as_ref().is_none_or(|list| list.split(',').any(|name| name == key));
    for scene in scenes.split(',') {
        for method in METHODS.iter().filter(|method| chosen(method.key)) {
            soak(scene, method.key, frames, seed);
        }
    }
}

fn soak(scene: &str, method: &str, frames: u64, seed: u64) {
    let gpu_assisted = variable("LINKLIGHT_SOAK_ASSISTED").is_some();
    let context = Context::new(Options { validation: true, gpu_assisted, ..Options::default() }).unwrap();
    let settings = SMALL.iter().find(|(key, _)| *key == method).map_or("", |(_, settings)| settings);
    // The tea room has 1,746 charts.
    let atlas = if scene == "tea-room" { "atlas_resolution=64" } else { "atlas_resolution=40" };
    let settings = settings.replace("atlas_resolution=40", atlas);
    let elements = variable("LINKLIGHT_SOAK_ELEMENTS")
        .filter(|_| !["path-tracing", "surface-shadow-maps", "face-cluster"].contains(&method))
        .map_or(String::new(), |count| format!("--elements {count}"));
    let asked = |state: &State| format!("builtin:{scene} --method {method} {elements} {settings} {}", state.options());
    let mut engine = Engine::new(&context);
    let (mut state, mut random) = (State { bounces: 1, ..State::default() }, Random(seed));
    let first_state = state.clone();
    let first = pixels(&context, &mut engine, &asked(&state));
    let has_lights = !engine.stage().unwrap().pose.lights.is_empty();
    let (mut levels, mut host, start) = (Vec::new(), Vec::new(), Instant::now());
    let every = (frames / 4).max(1);
    for frame in 1..=frames {
        state.change(&mut random, has_lights);
        let options = asked(&state);
        let picture = pixels(&context, &mut engine, &options);
        assert!(picture.iter().all(|pixel| pixel.is_finite()), "{options}: not finite in frame {frame}");
        // As the window does.
        context.take_records();
        if frame % every == 0 {
            let fresh = pixels(&context, &mut Engine::new(&context), &options);
            assert!(picture == fresh, "{options}: frame {frame} of seed {seed} is not a new engine's");
            assert!(
                pixels(&context, &mut engine, &asked(&first_state)) == first,
                "{options}: frame {frame}, then back"
            );
            levels.push(bytes(&context));
            host.extend(resident());
        }
    }
    println!(
        "{scene} {method}: {frames} frames in {:.0?}, bytes at rest {levels:?}, MiB of the process {host:?}",
        start.elapsed()
    );
    // By the second sample everything that is kept for further use was made.
    assert!(levels[1..].iter().all(|level| level == &levels[1]), "{scene} {method}: memory grows: {levels:?}");
    // What the allocator keeps varies a little; other tests of the process make it vary more.
    let is_alone = variable("LINKLIGHT_SOAK_FRAMES").is_some();
    let grows = is_alone && host.iter().any(|level| *level > host[1] + 64);
    assert!(!grows, "{scene} {method}: the process grows: {host:?} MiB");
    // The layer says first what it switches on for itself.
    let is_setting = |m: &String| m.contains("layer settings provided") || m.contains("is adjusting settings");
    let said: Vec<String> = context.validation_messages().into_iter().filter(|m| !is_setting(m)).collect();
    assert_eq!(said, [""; 0], "{scene} {method}");
}
