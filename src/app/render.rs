//! `linklight render`: the options as one typed, checked request.

use std::io::{self, Write};
use std::path::PathBuf;
use std::time::Instant;

use glam::{UVec2, Vec3};
use serde_json::{Map, Value, json};

use super::cli::{Channel, Display, Global, PictureArgs, Rays, RenderArgs};
use super::console::{Console, Verbosity, Watcher};
use super::edits::Edit;
use super::interrupt::Interrupt;
use super::measure::milliseconds;
use super::output::Measured;
use super::stage::Stage;
use super::target::{self, Picked, Target};
use super::values::{CameraChoice, Format, Output, SceneSource};
use super::{AppError, crash, explain, frame, output, views};
use crate::display::final_gather;
pub use crate::display::tone_map::LightParts;
use crate::gpu::{Capture, Context, Options, prepare_capture};
use crate::methods::settings::{Assignment, SettingGroup, SettingValue as _};
use crate::methods::{AUTO, METHODS, Method};
use crate::report::tonemap::ToneSettings;
use crate::report::trace::TimeLine;
use crate::report::write::{check_writable, write_text};
use crate::scene::environment::load::EnvironmentSource;
use crate::stages::film::Film;

/// Largest storage buffer of the device that `--small-device` pretends to have, bytes.
const SMALL_STORAGE_BYTES: u64 = 16 << 20;
/// Samples per pixel of path-tracing: paths.
const DEFAULT_SPP: u32 = 64;
/// Samples per pixel of a display stage: places within the pixel, for smooth edges.
const DEFAULT_DISPLAY_SPP: u32 = 4;

/// Everything that decides a picture: options checked alone and against each other.
#[derive(Debug, Clone)]
pub struct RenderRequest {
    pub scene: SceneSource,
    pub output: Output,
    pub method: &'static Method,
    /// `None` for path-tracing, which has pixels of its own.
    pub display: Option<Display>,
    /// Indirect bounces after the direct light.
    pub bounces: u32,
    /// Pixels.
    pub width: u32,
    pub height: u32,
    /// Samples per pixel: paths of path-tracing, places within the pixel of a display stage.
    pub spp: u32,
    /// Animation time.
    pub seconds: f32,
    /// Frames to compute, at least 1; the last one is written.
    pub frames: u32,
    /// `None` takes the first of the scene, else one framed on its bounds.
    pub camera: Option<CameraChoice>,
    /// In place of a camera.
    pub free_camera: Option<FreeCamera>,
    pub environment: Option<EnvironmentSource>,
    /// Degrees about the vertical.
    pub environment_turn: f32,
    /// Specular reflection is left out.
    pub diffuse: bool,
    pub light: LightParts,
    /// Tessellation target; `None` leaves the scene as it is.
    pub elements: Option<u32>,
    pub tone: ToneSettings,
    pub rays: Rays,
    pub seed: u32,
    /// What is wrong with the film's values, in place of light.
    pub shows_bad_values: bool,
    /// Changes of the scene.
    pub edits: Vec<Edit>,
    /// Checked: [`RenderRequest::settings`] of the method's own type succeeds.
    pub assignments: Vec<Assignment>,
    /// Those of the display stage, checked.
    pub display_assignments: Vec<Assignment>,
    /// Each at most once, in order of declaration.
    pub channels: Vec<Channel>,
    /// Where the irradiance of the atlas goes.
    pub lightmap: Option<PathBuf>,
    pub profile: Option<PathBuf>,
    pub trace: Option<PathBuf>,
    pub capture: Option<PathBuf>,
    /// The frame that is captured, counted from 1; the last where none is named.
    pub capture_frame: Option<u32>,
    pub hashes: Option<PathBuf>,
    /// Further GPUs that make links.
    pub link_gpus: Vec<String>,
    /// A pixel to explain, and where to write all of it.
    pub explain: Option<(UVec2, Option<PathBuf>)>,
    /// Settings are picked for this error first.
    pub target: Option<Target>,
}

/// The display stages that can show a method's solution, the default first; none for one with pixels of its own.
pub fn displays(method: &Method) -> &'static [Display] {
    match method.key {
        "path-tracing" => &[],
        "surface-shadow-maps" => &[Display::FinalGather, Display::Lightmap],
        "face-cluster" => &[Display::IrradianceVector, Display::FinalGather],
        "antiradiance" => &[Display::Vertex, Display::Splat, Display::FinalGather],
        _ => &[Display::Vertex, Display::FinalGather],
    }
}

/// Those that the display stage declares, and the others, which the method must know.
fn split_assignments(display: Option<Display>, all: Vec<Assignment>) -> (Vec<Assignment>, Vec<Assignment>) {
    let specs = match display {
        Some(Display::FinalGather) => final_gather::Settings::specs(),
        _ => Vec::new(),
    };
    all.into_iter().partition(|assignment| specs.iter().any(|spec| spec.name == assignment.key))
}

/// A camera that is none of the scene's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreeCamera {
    /// Metres.
    pub eye: Vec3,
    pub look_at: Vec3,
    /// Vertical field of view, degrees.
    pub fov: f32,
}

impl TryFrom<RenderArgs> for RenderRequest {
    type Error = AppError;

    fn try_from(args: RenderArgs) -> Result<Self, AppError> {
        let usage = |message: String| Err(AppError::Usage(message));
        if args.output.format == Format::Png && !args.channels.is_empty() {
            let output = args.output.path.display();
            return usage(format!("--channels needs an .exr; {output} is a .png and has no room for them"));
        }
        let any_method = args.picture.method.key == AUTO.key;
        if any_method && args.target_error.is_none() {
            return usage("--method auto needs to know what for: give --target-error too".into());
        }
        if any_method && (!args.picture.set.is_empty() || args.picture.display.is_some()) {
            return usage("--method auto picks settings and display too; leave out --set and --display".into());
        }
        let method = if any_method { &METHODS[0] } else { args.picture.method };
        let picture = PictureArgs { method, ..args.picture };
        let key = method.key;
        if args.lightmap.is_some() && key != "surface-shadow-maps" {
            return usage(format!("--lightmap needs --method surface-shadow-maps; {key} has no atlas"));
        }
        let mut request = Self::of_picture(&picture, args.output)?;

        if let Some(pixel) = args.explain {
            explain::check(&request, pixel)?;
        }
        let mut written = vec![&request.output.path];
        let others = [&args.lightmap, &args.profile, &args.trace, &args.capture, &args.hashes, &args.explain_json];
        written.extend(others.into_iter().flatten());
        for (index, path) in written.iter().enumerate() {
            if written[..index].contains(path) {
                return usage(format!("two outputs are called {}; give each its own name", path.display()));
            }
            check_writable(path)?;
        }
        for channel in args.channels {
            if !request.channels.contains(&channel) {
                request.channels.push(channel);
            }
        }
        request.channels.sort_by_key(|channel| *channel as u32);
        request.frames = args.frames;
        request.lightmap = args.lightmap;
        request.profile = args.profile;
        request.trace = args.trace;
        request.capture = args.capture;
        if let Some(frame) = args.capture_frame.filter(|frame| *frame > args.frames) {
            let frames = args.frames;
            return usage(format!(
                "--capture-frame {frame}: there are {frames} frames; raise --frames or name another"
            ));
        }
        request.capture_frame = args.capture_frame;
        if !args.link_gpu.is_empty() && key != "explicit-visibility" {
            return usage(format!("--link-gpu needs --method explicit-visibility; {key} makes no links by rays"));
        }
        request.link_gpus = args.link_gpu;
        request.hashes = args.hashes;
        request.explain = args.explain.map(|pixel| (pixel, args.explain_json));
        request.target = args.target_error.map(|error| Target { error, any_method });
        Ok(request)
    }
}

impl RenderRequest {
    /// One frame of the picture that `args` decide, for `output`, and nothing written beside it.
    pub fn of_picture(args: &PictureArgs, output: Output) -> Result<Self, AppError> {
        let mut args = args.clone();
        views::resolve(&mut args)?;
        let usage = |message: String| Err(AppError::Usage(message));
        let method = args.method;
        if method.key == AUTO.key {
            return usage("--method auto is for `linklight render --target-error`".into());
        }
        let path_traced = method.key == "path-tracing";
        if path_traced && args.display.is_some() {
            return usage(
                "--display applies to methods that solve on elements; path-tracing has pixels of its own".into(),
            );
        }
        if args.indirect_only && args.bounces == 0 {
            return usage("--indirect-only with --bounces 0 is black everywhere; ask for at least 1 bounce".into());
        }
        let displays = displays(method);
        let display = displays.first().map(|&default| args.display.unwrap_or(default));
        if display.is_some_and(|shown| !displays.contains(&shown)) {
            let key = method.key;
            let (what, others) = if displays.contains(&Display::Lightmap) {
                ("texels, not vertices", "final-gather or lightmap")
            } else if displays.contains(&Display::IrradianceVector) {
                ("clusters of faces, not vertices", "irradiance-vector or final-gather")
            } else if displays.contains(&Display::Splat) {
                ("vertices and patches, not an atlas", "vertex, splat or final-gather")
            } else {
                ("vertices, not an atlas", "vertex or final-gather")
            };
            return usage(format!("{key} solves on {what}; show it by --display {others}"));
        }
        let (of_display, of_method) = split_assignments(display, args.set.clone());
        method.record(&of_method)?;
        final_gather::Settings::from_assignments(&of_display)?;

        let free_camera = match (args.eye, args.look_at) {
            (Some(eye), Some(look_at)) if eye.distance(look_at) > 0.0 => {
                Some(FreeCamera { eye, look_at, fov: args.fov })
            }
            (Some(eye), Some(_)) => return usage(format!("--eye and --look-at are both {eye}; move one of them")),
            _ => None,
        };
        Ok(Self {
            scene: args.scene.clone(),
            output,
            method,
            display,
            bounces: args.bounces,
            width: args.size.0,
            height: args.size.1,
            spp: args.spp.unwrap_or(if path_traced { DEFAULT_SPP } else { DEFAULT_DISPLAY_SPP }),
            seconds: args.seconds,
            frames: 1,
            camera: args.camera.clone(),
            free_camera,
            environment: args.env.clone(),
            environment_turn: args.env_turn,
            diffuse: args.diffuse,
            light: match (args.direct_only, args.indirect_only) {
                (true, _) => LightParts::DirectOnly,
                (_, true) => LightParts::IndirectOnly,
                _ => LightParts::All,
            },
            elements: args.elements,
            tone: ToneSettings { operator: args.tonemap, exposure: args.exposure, ..ToneSettings::default() },
            rays: args.rays,
            seed: args.seed,
            shows_bad_values: views::shows_bad_values(&args),
            edits: args.edit.clone(),
            assignments: of_method,
            display_assignments: of_display,
            channels: Vec::new(),
            lightmap: None,
            profile: None,
            trace: None,
            capture: None,
            capture_frame: None,
            hashes: None,
            link_gpus: Vec::new(),
            explain: None,
            target: None,
        })
    }

    /// The method's settings, typed; `S` must be the `Settings` of [`Self::method`].
    pub fn settings<S: SettingGroup>(&self) -> Result<S, AppError> {
        Ok(S::from_assignments(&self.assignments)?)
    }

    /// The settings of the per-pixel final gather.
    pub fn final_gather_settings(&self) -> Result<final_gather::Settings, AppError> {
        Ok(SettingGroup::from_assignments(&self.display_assignments)?)
    }

    /// Everything that decides the picture, by name: recorded in pictures, profiles and traces.
    pub fn record(&self) -> Result<Map<String, Value>, AppError> {
        let camera = self.camera.as_ref().map(|camera| camera.name.as_str());
        let environment = self.environment.as_ref().map(|environment| match environment {
            EnvironmentSource::File(path) => json!(path.display().to_string()),
            EnvironmentSource::Constant(radiance) => json!(radiance.to_array().map(|value| value.to_json())),
        });
        let mut record = Map::new();
        let mut insert = |name: &str, value: Value| record.insert(name.to_owned(), value);
        insert("method", self.method.key.into());
        insert("bounces", self.bounces.into());
        insert("size", json!([self.width, self.height]));
        insert("seconds", self.seconds.to_json());
        insert("frames", self.frames.into());
        insert("camera", json!(camera));
        insert("environment", json!(environment));
        if let Some(FreeCamera { eye, look_at, fov }) = self.free_camera {
            let place = |place: Vec3| json!(place.to_array().map(|value| value.to_json()));
            insert("eye", place(eye));
            insert("look_at", place(look_at));
            insert("fov", fov.to_json());
        }
        if self.environment_turn != 0.0 {
            insert("environment_turn", self.environment_turn.to_json());
        }
        if !self.edits.is_empty() {
            insert("edits", json!(self.edits.iter().map(Edit::to_string).collect::<Vec<_>>()));
        }
        if self.shows_bad_values {
            insert("view", views::BAD_VALUES.name.into());
        }
        insert("diffuse", self.diffuse.into());
        insert("light", self.light.name().into());
        insert("elements", json!(self.elements));
        insert("rays", serde_json::to_value(self.rays)?);
        insert("seed", self.seed.into());
        if let Some(display) = self.display {
            insert("display", serde_json::to_value(display)?);
        }
        if self.display == Some(Display::FinalGather) {
            insert("display_settings", self.final_gather_settings()?.record().into());
        }
        insert("spp", self.spp.into());
        if self.output.format == Format::Png {
            insert("exposure", self.tone.exposure.to_json());
            insert("tonemap", serde_json::to_value(self.tone.operator)?);
        }
        insert("settings", self.method.record(&self.assignments)?.into());
        Ok(record)
    }
}

/// Render and write what was asked for, by settings picked for an error where that was asked for.
pub fn run(
    request: &RenderRequest,
    global: &Global,
    console: &Console,
    interrupt: &Interrupt,
    out: &mut dyn Write,
) -> Result<(), AppError> {
    let Some(target) = request.target else { return render(request, global, console, interrupt, out) };
    let watch = Watcher::new(console, interrupt);
    let mut say = |line: String| -> Result<(), AppError> { Ok(writeln!(out, "{line}")?) };
    let Picked { request, predicted, achieved, words } = target::pick(request, target, global, &watch, &mut say)?;
    let start = Instant::now();
    render(&request, global, console, interrupt, out)?;
    writeln!(out, "picked {words}")?;
    writeln!(out, "predicted relative MSE {:.4}, {:.0} ms", predicted.error, predicted.ms)?;
    writeln!(out, "achieved relative MSE {:.4} (by a pilot), {:.0} ms", achieved.error, milliseconds(start))?;
    Ok(())
}

fn render(
    request: &RenderRequest,
    global: &Global,
    console: &Console,
    interrupt: &Interrupt,
    out: &mut dyn Write,
) -> Result<(), AppError> {
    if request.capture.is_some() {
        prepare_capture()?;
    }
    let time_line = TimeLine::default();
    let counts = Counts { statistics: request.profile.is_some(), hashes: request.hashes.is_some() };
    let context = time_line.span("open device", || open_counting_device(global, counts, request.record()?))?;
    let device = context.info();
    tracing::info!("device {} {} ({})", device.index, device.name, device.driver);
    let mut capture = request.capture.as_ref().map(|path| Capture::new(&context, path)).transpose()?;
    interrupt.check()?;
    let stage = Stage::new(&context, request, &time_line)?;
    let film = Film::new(&context, request.width, request.height)?;
    let watch = Watcher::new(console, interrupt);
    let mut method = time_line.span("prepare method", || frame::Method::prepare(&context, request, &stage, &watch))?;
    let mut partial = None;
    for number in 1..=request.frames {
        interrupt.check()?;
        let mut capture = capture.take_if(|_| number == request.capture_frame.unwrap_or(request.frames));
        if let Some(capture) = &mut capture {
            capture.start();
        }
        let name = format!("frame {number}");
        match time_line.span(&name, || method.frame(&context, request, &stage, &film, &watch)) {
            Err(error @ AppError::Partial(_)) => partial = Some(error),
            other => other?,
        }
        if let Some(capture) = capture {
            time_line.span("write capture", || capture.finish())?;
        }
        if partial.is_some() {
            break;
        }
    }
    let records = context.take_records();
    let picture = time_line.span("read back", || frame::picture(&context, request, &film))?;
    time_line.span("write picture", || output::write_picture(request, picture, context.info()))?;
    let measured =
        Measured { context: &context, time_line: &time_line, records, scene: stage.facts(), method: method.report()? };
    if global.verbosity() >= Verbosity::Detailed {
        output::write_measurements(request, measured, out)?;
    } else {
        output::write_measurements(request, measured, &mut io::sink())?;
    }
    if let Some(path) = &request.hashes {
        output::write_hashes(request, &context, path)?;
    }
    if let (Some((pixel, file)), None) = (&request.explain, &partial) {
        let frame = explain::Frame { context: &context, request, stage: &stage, film: &film, watch: &watch };
        let explanation = explain::explain(frame, &mut method, *pixel)?;
        write!(out, "{}", explanation.to_text())?;
        if let Some(path) = file {
            write_text(path, &format!("{:#}\n", explanation.to_json()))?;
        }
        explanation.check().map_err(AppError::failed)?;
    }
    check_validation(&context)?;
    partial.map_or(Ok(()), Err)
}

/// The device of the global options; `statistics` counts what each pass does.
pub fn open_device(global: &Global, statistics: bool) -> Result<Context, AppError> {
    open_counting_device(global, Counts { statistics, hashes: false }, Map::new())
}

/// What is kept of every pass.
#[derive(Debug, Clone, Copy)]
struct Counts {
    statistics: bool,
    hashes: bool,
}

fn open_counting_device(global: &Global, counts: Counts, settings: Map<String, Value>) -> Result<Context, AppError> {
    let options = Options {
        statistics: counts.statistics,
        hash_passes: counts.hashes,
        on_loss: Some(crash::hook(global, settings, crash::own_command)),
        ..device_options(global)
    };
    Ok(Context::new(options)?)
}

/// What the global options say of a device.
pub(super) fn device_options(global: &Global) -> Options {
    Options {
        gpu: global.gpu.clone(),
        validation: global.validate,
        pipeline_cache: pipeline_cache(),
        full_barriers: global.full_barriers,
        no_optional_features: global.small_device,
        max_storage_buffer_bytes: global.small_device.then_some(SMALL_STORAGE_BYTES),
        max_memory_bytes: global.max_memory,
        timeout: global.gpu_timeout,
        lose_device_at: global.lose_device_at.clone(),
        no_pass_times: !global.pass_times,
        ..Options::default()
    }
}

/// Fails where validation had anything to say.
pub fn check_validation(context: &Context) -> Result<(), AppError> {
    let messages = context.validation_messages();
    match messages.first() {
        None => Ok(()),
        Some(first) => {
            Err(AppError::failed(format!("validation reported {} messages, the first: {first}", messages.len())))
        }
    }
}

/// Where the driver's compiled pipelines are kept between runs.
pub(super) fn pipeline_cache() -> Option<PathBuf> {
    Some(cache_folder()?.join("pipelines.bin"))
}

/// What is kept between runs goes to the user's cache folder, where there is one.
pub(super) fn cache_folder() -> Option<PathBuf> {
    let folder = std::env::var_os("XDG_CACHE_HOME")
        .map(PathBuf::from)
        .or_else(|| std::env::var_os("LOCALAPPDATA").map(PathBuf::from))
        .or_else(|| std::env::var_os("HOME").map(|home| PathBuf::from(home).join(".cache")))?;
    folder.is_absolute().then(|| folder.join("linklight"))
}

#[cfg(test)]
#[path = "render_tests.rs"]
mod tests;
