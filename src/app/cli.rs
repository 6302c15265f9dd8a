//! The command line, declared for clap. Values are checked here as far as one value alone can be; [`super::render`]
//! checks them against each other. Commands that measure stand in `cli_evidence.rs`.

use std::path::PathBuf;
use std::time::Duration;

use clap::{ArgAction, Args, Parser, Subcommand, ValueEnum};
use glam::{UVec2, Vec3};

pub use super::cli_evidence::*;
use super::console::Verbosity;
use super::edits::Edit;
use super::values::{
    CameraChoice, Output, SceneSource, parse_animation_seconds, parse_exposure, parse_field_of_view, parse_fraction,
    parse_memory, parse_method, parse_method_or_auto, parse_pixel, parse_place, parse_size, parse_switch,
    parse_timeout, parse_turn,
};
use crate::gpu::LossPoint;
use crate::methods::Method;
use crate::methods::settings::Assignment;
use crate::report::tonemap::Operator;
use crate::scene::environment::load::EnvironmentSource;

/// Renders glTF scenes by published finite-element global-illumination methods beside a path-traced reference
#[derive(Debug, Parser)]
#[command(name = "linklight", version, max_term_width = 110, after_help = EXIT_CODES)]
pub struct Cli {
    #[command(flatten)]
    pub global: Global,
    #[command(subcommand)]
    pub command: Command,
}

const EXIT_CODES: &str = "Exit codes: 0 done, 1 the work failed, 2 wrong usage, 3 no usable GPU.";

/// Options of every command.
#[derive(Debug, Clone, Default, Args)]
pub struct Global {
    /// GPU to use: part of its name, or its index in `linklight devices`
    #[arg(long, global = true, value_name = "NAME|INDEX")]
    pub gpu: Option<String>,
    /// Run with the Vulkan validation layers; any error they report fails the command
    #[arg(long, global = true)]
    pub validate: bool,
    /// Give up on GPU work that does not end within this long, seconds [default: 600]
    #[arg(long, global = true, value_name = "SECONDS", value_parser = parse_timeout)]
    pub gpu_timeout: Option<Duration>,
    /// Where to tell of a lost GPU [default: crash-*.json in the user's cache folder]
    #[arg(long, global = true, value_name = "FILE.json")]
    pub crash_file: Option<PathBuf>,
    /// Lose the GPU on purpose when it comes to this pass (as --profile names it, gather/links@3 its third run), to see
    /// what is told of it
    #[arg(long, global = true, value_name = "PASS[@N]")]
    pub lose_device_at: Option<LossPoint>,
    /// Put a full barrier before every pass: if the picture changes by it, a hazard was missed
    #[arg(long, global = true)]
    pub full_barriers: bool,
    /// Pretend that the GPU offers the least that is enough: 16 MiB in one storage buffer, nothing optional
    #[arg(long, global = true)]
    pub small_device: bool,
    /// Most memory that a scene and what is made of it may take, such as 512M or 12G, on the host and again on the GPU;
    /// what needs more is refused before it is allocated [default: 8G on the host, all there is on the GPU]
    #[arg(long, global = true, value_name = "SIZE", value_parser = parse_memory)]
    pub max_memory: Option<u64>,
    /// Take times of all passes, and label and mark them; what that costs is told by `linklight bench SCENE --vary
    /// pass-times=off,on`
    #[arg(long, global = true, value_name = "on|off", default_value = "on", action = ArgAction::Set,
          value_parser = parse_switch)]
    pub pass_times: bool,
    /// Say nothing but errors
    #[arg(long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Say more; twice for everything
    #[arg(short, long, global = true, action = ArgAction::Count)]
    pub verbose: u8,
}

#[cfg(test)]
impl Global {
    /// What a command line says that has none of them.
    pub const UNSAID: Self = Self {
        gpu: None,
        validate: false,
        full_barriers: false,
        small_device: false,
        max_memory: None,
        gpu_timeout: None,
        crash_file: None,
        lose_device_at: None,
        pass_times: true,
        quiet: false,
        verbose: 0,
    };
}

impl Global {
    pub fn verbosity(&self) -> Verbosity {
        match (self.quiet, self.verbose) {
            (true, _) => Verbosity::Quiet,
            (false, 0) => Verbosity::Normal,
            (false, 1) => Verbosity::Detailed,
            (false, _) => Verbosity::All,
        }
    }
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene into a picture
    Render(Box<RenderArgs>),
    /// Look at a scene in a window: cameras, methods, all settings, times of all passes
    View(Box<ViewArgs>),
    /// Hold methods and settings to the reference: error, energy, time and memory as a page that opens from disk
    Compare(CompareArgs),
    /// Measure how long frames and passes take: methods, settings and devices in turns, with confidence
    Bench(BenchArgs),
    /// Hold every table and figure of the methods' papers to what is measured here: a page
    Papers(PapersArgs),
    /// Measure how much light each method lets through closed walls
    Leak(LeakArgs),
    /// Measure how long each method takes until a change of the lights is seen
    Lag(LagArgs),
    /// Write a method's solution into the scene: vertex colours, a lightmap, or light by direction
    Bake(BakeArgs),
    /// Print how far picture A is from reference B
    Diff(DiffArgs),
    /// Find the first pass in which two runs of `linklight render --hashes` part
    Diverge(DivergeArgs),
    /// List the GPUs, usable or not, and what they offer
    Devices(DevicesArgs),
    /// List the methods and their settings
    Methods(MethodsArgs),
}

/// What decides a picture, of `render` and of `view` alike.
#[derive(Debug, Clone, Args)]
pub struct PictureArgs {
    /// A .gltf or .glb file, or builtin:NAME
    #[arg(value_name = "SCENE")]
    pub scene: SceneSource,
    /// Take SCENE and options from a state file, which `linklight view` writes; further options override it
    #[arg(long, value_name = "FILE")]
    pub state: Option<PathBuf>,
    /// Method, see `linklight methods`; with --target-error also auto
    #[arg(long, value_name = "KEY", value_parser = parse_method_or_auto, default_value = "explicit-visibility")]
    pub method: &'static Method,
    /// How the solution becomes pixels [default: vertex; final-gather for surface-shadow-maps; path-tracing has none]
    #[arg(long, value_enum)]
    pub display: Option<Display>,
    /// Indirect bounces after the direct light
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(0..=64))]
    pub bounces: u32,
    /// Width and height in pixels
    #[arg(long, value_name = "WxH", default_value = "960x540", value_parser = parse_size)]
    pub size: (u32, u32),
    /// Samples per pixel: paths of path-tracing [default: 64], else places within the pixel [default: 4]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_048_576))]
    pub spp: Option<u32>,
    /// Animation time in seconds
    #[arg(long, value_name = "T", default_value_t = 0.0, value_parser = parse_animation_seconds, allow_negative_numbers = true)]
    pub seconds: f32,
    /// Camera of the scene, by name or index [default: the first, else one framed on the bounds]
    #[arg(long, value_name = "NAME|INDEX")]
    pub camera: Option<CameraChoice>,
    /// Look from here, metres, in place of a camera of the scene
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_place, allow_hyphen_values = true, requires = "look_at")]
    pub eye: Option<Vec3>,
    /// ... towards here
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_place, allow_hyphen_values = true, requires = "eye")]
    pub look_at: Option<Vec3>,
    /// ... with this vertical field of view, degrees
    #[arg(long, value_name = "DEGREES", default_value_t = 40.0, value_parser = parse_field_of_view)]
    pub fov: f32,
    /// Environment: an equirectangular .hdr/.exr picture, or one radiance for all directions [default: none]
    #[arg(long, value_name = "FILE|R,G,B", allow_hyphen_values = true)]
    pub env: Option<EnvironmentSource>,
    /// Turn the environment about the vertical, degrees
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, value_parser = parse_turn, allow_negative_numbers = true)]
    pub env_turn: f32,
    /// Leave out specular reflection: every surface is Lambertian with its base colour
    #[arg(long)]
    pub diffuse: bool,
    /// Only light that comes straight from lights, emitters and the environment
    #[arg(long, conflicts_with = "indirect_only")]
    pub direct_only: bool,
    /// Only light that was reflected at least once before
    #[arg(long)]
    pub indirect_only: bool,
    /// Tessellate to about this many elements [default: 20000 or more, no edge above 1/40
    /// of the scene's diagonal; path-tracing: as the scene is]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=50_000_000))]
    pub elements: Option<u32>,
    /// Exposure in stops, for .png
    #[arg(long, value_name = "EV", default_value_t = 0.0, value_parser = parse_exposure, allow_negative_numbers = true)]
    pub exposure: f32,
    /// Tone mapping, for .png
    #[arg(long, value_enum, default_value_t)]
    pub tonemap: Operator,
    /// How rays are cast
    #[arg(long, value_enum, default_value_t)]
    pub rays: Rays,
    /// Seed of all random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u32,
    /// A setting of the method or of the display, see `linklight methods`; may be repeated
    #[arg(long, value_name = "KEY=VALUE", value_parser = Assignment::parse)]
    pub set: Vec<Assignment>,
    /// Show this in place of light, see `linklight methods --views`
    #[arg(long, value_name = "NAME")]
    pub view: Option<String>,
    /// Change the scene, such as material:3.albedo=0.8,0.2,0.1; material: albedo, roughness, metallic, emission; light:
    /// intensity; node: move (metres); may be repeated
    #[arg(long, value_name = "KIND:N.PROPERTY=VALUE", allow_hyphen_values = true)]
    pub edit: Vec<Edit>,
}

#[derive(Debug, Args)]
pub struct RenderArgs {
    #[command(flatten)]
    pub picture: PictureArgs,
    /// Picture to write: .exr holds linear radiance, .png what a display shows
    #[arg(short, long, value_name = "FILE.exr|FILE.png")]
    pub output: Output,
    /// Pick settings by pilot runs, and with --method auto the method, for this relative MSE
    #[arg(long, value_name = "ERROR", value_parser = parse_fraction, conflicts_with_all = ["elements", "spp"])]
    pub target_error: Option<f64>,
    /// Frames to compute; the last one is written
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub frames: u32,
    /// Extra channels of an .exr, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', value_name = "NAME,...")]
    pub channels: Vec<Channel>,
    /// Write the irradiance of the atlas' texels, W/m2, without punctual direct light (surface-shadow-maps)
    #[arg(long, value_name = "FILE.exr")]
    pub lightmap: Option<PathBuf>,
    /// Write times, bytes and counters of every pass as JSON
    #[arg(long, value_name = "FILE.json")]
    pub profile: Option<PathBuf>,
    /// Write a time line of CPU and GPU for Perfetto or chrome://tracing
    #[arg(long, value_name = "FILE.trace.json")]
    pub trace: Option<PathBuf>,
    /// Write a RenderDoc capture of the last frame
    #[arg(long, value_name = "FILE.rdc", conflicts_with = "link_gpu")]
    pub capture: Option<PathBuf>,
    /// ... or of this one, counted from 1
    #[arg(long, value_name = "N", requires = "capture", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub capture_frame: Option<u32>,
    /// A further GPU that makes links, by part of its name or index (explicit-visibility); the picture stays the same, bit
    /// for bit, on GPUs of one driver; may be repeated
    #[arg(long, value_name = "NAME|INDEX")]
    pub link_gpu: Vec<String>,
    /// Tell which elements, links and bounces make up this pixel, counted from the top left corner
    #[arg(long, value_name = "X,Y", value_parser = parse_pixel)]
    pub explain: Option<UVec2>,
    /// ... and write all of them as JSON
    #[arg(long, value_name = "FILE.json", requires = "explain")]
    pub explain_json: Option<PathBuf>,
    /// Write hashes of what every pass leaves in its buffers, for `linklight diverge`
    #[arg(long, value_name = "FILE.json")]
    pub hashes: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct ViewArgs {
    #[command(flatten)]
    pub picture: PictureArgs,
    /// Folder of screenshots and states
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub shots: PathBuf,
    /// Show another method beside the picture; path-tracing is the reference, which goes on refining
    #[arg(long, value_name = "KEY", value_parser = parse_method)]
    pub against: Option<&'static Method>,
    /// ... or how far the picture is from it
    #[arg(long, requires = "against")]
    pub difference: bool,
    /// Start with the panels hidden: the picture fills the window
    #[arg(long)]
    pub bare: bool,
    /// Write a RenderDoc capture of the first picture in full quality, made once more when all is prepared
    #[arg(long, value_name = "FILE.rdc", conflicts_with = "link_gpu")]
    pub capture: Option<PathBuf>,
    /// ... or of this picture, counted from 1, with everything that was made for it
    #[arg(long, value_name = "N", requires = "capture", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub capture_frame: Option<u32>,
    /// A further GPU that makes links, as in `linklight render`; may be repeated
    #[arg(long, value_name = "NAME|INDEX")]
    pub link_gpu: Vec<String>,
    /// Write times, bytes and counters of every pass of the last pictures as JSON when the window is closed
    #[arg(long, value_name = "FILE.json")]
    pub profile: Option<PathBuf>,
    /// ... and their time line, for Perfetto or chrome://tracing
    #[arg(long, value_name = "FILE.trace.json")]
    pub trace: Option<PathBuf>,
    /// Watch this folder of shaders, a checkout's glsl, and take what changes; errors are shown over the picture
    #[arg(long, value_name = "DIR")]
    pub shaders: Option<PathBuf>,
}

/// Display stages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Display {
    /// Interpolate the solution between vertices
    #[default]
    Vertex,
    /// Draw flat patches as rectangles that fade into one another (antiradiance)
    Splat,
    /// Gather from the solution at every pixel, with visibility
    FinalGather,
    /// Filter the texels of the method's atlas (surface-shadow-maps)
    Lightmap,
    /// Shade by the vector irradiance of elements: face-cluster's own, and its default
    IrradianceVector,
}

/// Ways to cast rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rays {
    /// The GPU's own traversal where it has one, else compute
    #[default]
    Auto,
    /// Our own traversal in compute shaders
    Compute,
    /// The device's traversal (VK_KHR_ray_query)
    RayQuery,
}

/// Named channels of an EXR beside RGB.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, ValueEnum)]
pub enum Channel {
    /// direct.R, .G, .B: radiance from direct light
    Direct,
    /// indirect.R, .G, .B: radiance from reflected light
    Indirect,
    /// albedo.R, .G, .B: diffuse reflectance
    Albedo,
    /// normal.X, .Y, .Z: unit normal in world space
    Normal,
    /// depth.Z: distance from the camera along the pixel's ray, metres
    Depth,
}

#[derive(Debug, Args)]
pub struct DevicesArgs {
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct MethodsArgs {
    /// List the debug views
    #[arg(long, conflicts_with = "json")]
    pub views: bool,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_declaration_is_sound() {
        use clap::CommandFactory as _;
        Cli::command().debug_assert();
    }
}
