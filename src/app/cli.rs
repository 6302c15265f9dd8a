//! The command line, declared for clap. Values are checked here as far as one value alone can be; [`super::render`]
//! checks them against each other.

use std::path::PathBuf;

use clap::{ArgAction, Args, Parser, Subcommand, ValueEnum};
use glam::Vec3;

use super::compare::Variation;
use super::console::Verbosity;
use super::diff::Limit;
use super::edits::Edit;
use super::values::{
    CameraChoice, Output, SceneSource, parse_animation_seconds, parse_exposure, parse_field_of_view, parse_fraction,
    parse_glb, parse_measuring_seconds, parse_method, parse_method_or_auto, parse_place, parse_scale, parse_size,
    parse_turn, parse_wall,
};
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
#[derive(Debug, Clone, Args)]
pub struct Global {
    /// GPU to use: part of its name, or its index in `linklight devices`
    #[arg(long, global = true, value_name = "NAME|INDEX")]
    pub gpu: Option<String>,
    /// Run with the Vulkan validation layers; any error they report fails the command
    #[arg(long, global = true)]
    pub validate: bool,
    /// Say nothing but errors
    #[arg(long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Say more; twice for everything
    #[arg(short, long, global = true, action = ArgAction::Count)]
    pub verbose: u8,
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
    #[arg(long, value_name = "FILE.rdc")]
    pub capture: Option<PathBuf>,
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
    /// Start with the panels hidden: the picture fills the window
    #[arg(long)]
    pub bare: bool,
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
pub struct CompareArgs {
    /// .gltf or .glb files, or builtin:NAME
    #[arg(value_name = "SCENE", required = true)]
    pub scenes: Vec<SceneSource>,
    /// Folder of the page, the data and the pictures; made when missing
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Method, see `linklight methods`; may be repeated [default: all but path-tracing]
    #[arg(long, value_name = "KEY", value_parser = parse_method)]
    pub method: Vec<&'static Method>,
    /// A method's setting or an option of `render`, by every value; may be repeated for all combinations
    #[arg(long, value_name = "NAME=VALUE,...")]
    pub vary: Vec<Variation>,
    /// A setting, for every method that has it; may be repeated
    #[arg(long, value_name = "KEY=VALUE", value_parser = Assignment::parse)]
    pub set: Vec<Assignment>,
    /// Compare with this picture [default: path-traced, and kept in DIR for the next time]
    #[arg(long, value_name = "FILE.exr")]
    pub reference: Option<PathBuf>,
    /// Trace the reference until the standard error of a pixel is this fraction of the picture's mean
    #[arg(long, value_name = "FRACTION", default_value_t = 0.02, value_parser = parse_fraction, conflicts_with = "reference")]
    pub noise: f64,
    /// Paths per pixel at which the reference ends all the same
    #[arg(long, value_name = "N", default_value_t = 4096, value_parser = clap::value_parser!(u32).range(2..=1_048_576))]
    pub reference_spp: u32,
    /// Paths per pixel up to which path tracing is drawn beside the methods; 0 leaves it out
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(0..=65_536))]
    pub curve_spp: u32,
    /// Frames that are timed
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub frames: u32,
    /// Print the data of the page (DIR/compare.json) as JSON
    #[arg(long)]
    pub json: bool,
    /// Fail (exit code 1) if a figure of any picture is above this limit, as in `linklight diff`; may be repeated
    #[arg(long, value_name = "FIGURE=LIMIT")]
    pub fail_above: Vec<Limit>,
    /// Options of `linklight render` for all pictures, such as -- --size 480x270 --bounces 2
    #[arg(last = true, value_name = "RENDER OPTIONS")]
    pub options: Vec<String>,
}

#[derive(Debug, Args)]
pub struct BenchArgs {
    /// .gltf or .glb files, or builtin:NAME
    #[arg(value_name = "SCENE", required_unless_present = "read")]
    pub scenes: Vec<SceneSource>,
    /// Measurements to write
    #[arg(short, long, value_name = "FILE.json", required_unless_present = "read")]
    pub output: Option<PathBuf>,
    /// Method, see `linklight methods`; may be repeated [default: all]
    #[arg(long, value_name = "KEY", value_parser = parse_method)]
    pub method: Vec<&'static Method>,
    /// A method's setting or an option of `render` (gpu too), by every value; may be repeated for all combinations
    #[arg(long, value_name = "NAME=VALUE,...")]
    pub vary: Vec<Variation>,
    /// A setting, for every method that has it; may be repeated
    #[arg(long, value_name = "KEY=VALUE", value_parser = Assignment::parse)]
    pub set: Vec<Assignment>,
    /// Measure until ratios to the first subject are known to this fraction, with 99 % confidence
    #[arg(long, value_name = "FRACTION", default_value_t = 0.01, value_parser = parse_fraction)]
    pub precision: f64,
    /// ... or for so many seconds
    #[arg(long, value_name = "S", default_value_t = 60.0, value_parser = parse_measuring_seconds)]
    pub seconds: f64,
    /// Say what became slower or faster since this file was written, beyond what the machine did
    #[arg(long, value_name = "OLD.json")]
    pub against: Option<PathBuf>,
    /// Measure nothing: take this file in place of new measurements
    #[arg(long, value_name = "FILE.json", requires = "against", conflicts_with_all = ["scenes", "output"])]
    pub read: Option<PathBuf>,
    /// Fail (exit code 1) if anything became slower
    #[arg(long, requires = "against")]
    pub fail_slower: bool,
    /// Options of `linklight render` for all subjects, such as -- --size 480x270 --bounces 2
    #[arg(last = true, value_name = "RENDER OPTIONS")]
    pub options: Vec<String>,
}

#[derive(Debug, Args)]
pub struct PapersArgs {
    /// Folder of the page and the data; made when missing
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Rows of this method's paper, see `linklight methods`; may be repeated [default: all]
    #[arg(long, value_name = "KEY", value_parser = parse_method)]
    pub method: Vec<&'static Method>,
    /// Only rows whose place ("Table 1"), words or scene contain this text
    #[arg(long, value_name = "TEXT")]
    pub only: Option<String>,
    /// Leave out what takes minutes on a software driver
    #[arg(long)]
    pub quick: bool,
    /// Frames that are timed
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub frames: u32,
    /// Trace references until the standard error of a pixel is this fraction of the picture's mean
    #[arg(long, value_name = "FRACTION", default_value_t = 0.03, value_parser = parse_fraction)]
    pub noise: f64,
    /// Paths per pixel at which references end all the same
    #[arg(long, value_name = "N", default_value_t = 2048, value_parser = clap::value_parser!(u32).range(2..=1_048_576))]
    pub reference_spp: u32,
    /// Print the data of the page (DIR/papers.json) as JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct LeakArgs {
    /// Measurements to write
    #[arg(short, long, value_name = "FILE.json")]
    pub output: Option<PathBuf>,
    /// Method, see `linklight methods`; may be repeated [default: all]
    #[arg(long, value_name = "KEY", value_parser = parse_method)]
    pub method: Vec<&'static Method>,
    /// Thicknesses of the wall, millimetres
    #[arg(long, value_name = "MM,...", value_delimiter = ',', default_value = "0,1,5,20,50,100", value_parser = parse_wall)]
    pub walls: Vec<u32>,
    /// Materials of the walls
    #[arg(long, value_enum, value_delimiter = ',', value_name = "SIDES,...", default_value = "one,two")]
    pub sides: Vec<WallSides>,
    /// A setting, for every method that has it; may be repeated
    #[arg(long, value_name = "KEY=VALUE", value_parser = Assignment::parse)]
    pub set: Vec<Assignment>,
    /// Fail (exit code 1) if a larger share of the light comes through
    #[arg(long, value_name = "SHARE", value_parser = parse_fraction)]
    pub fail_above: Option<f64>,
    /// Options of `linklight render` for all pictures, such as -- --size 96x54 --elements 4000
    #[arg(last = true, value_name = "RENDER OPTIONS")]
    pub options: Vec<String>,
}

/// Sides from which walls are seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum WallSides {
    One,
    Two,
}

#[derive(Debug, Args)]
pub struct LagArgs {
    /// .gltf or .glb files with punctual lights, or builtin:NAME
    #[arg(value_name = "SCENE", required = true)]
    pub scenes: Vec<SceneSource>,
    /// Measurements to write
    #[arg(short, long, value_name = "FILE.json")]
    pub output: Option<PathBuf>,
    /// Method, see `linklight methods`; may be repeated [default: all]
    #[arg(long, value_name = "KEY", value_parser = parse_method)]
    pub method: Vec<&'static Method>,
    /// A setting, for every method that has it; may be repeated
    #[arg(long, value_name = "KEY=VALUE", value_parser = Assignment::parse)]
    pub set: Vec<Assignment>,
    /// How near to its final state a picture must be, as a share of its mean
    #[arg(long, value_name = "SHARE", default_value_t = 0.05, value_parser = parse_fraction)]
    pub within: f64,
    /// Frames after which a picture is given up
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub frames: u32,
    /// Options of `linklight render` for all pictures, such as -- --size 96x54 --elements 4000
    #[arg(last = true, value_name = "RENDER OPTIONS")]
    pub options: Vec<String>,
}

#[derive(Debug, Args)]
pub struct BakeArgs {
    /// A .gltf or .glb file, or builtin:NAME
    #[arg(value_name = "SCENE")]
    pub scene: SceneSource,
    /// Scene to write; a lightmap's .exr is written beside it
    #[arg(short, long, value_name = "FILE.glb", value_parser = parse_glb)]
    pub output: PathBuf,
    /// Where the light goes [default: vertex-colors; lightmap for surface-shadow-maps]
    #[arg(long, value_enum)]
    pub into: Option<BakeForm>,
    /// Method, see `linklight methods`
    #[arg(long, value_name = "KEY", value_parser = parse_method, default_value = "explicit-visibility")]
    pub method: &'static Method,
    /// A setting of the method; may be repeated
    #[arg(long, value_name = "KEY=VALUE", value_parser = Assignment::parse)]
    pub set: Vec<Assignment>,
    /// What surfaces are made of: unlit materials that show the light anywhere, or their own beside it
    #[arg(long, value_enum, default_value_t)]
    pub materials: BakeMaterials,
    /// Radiance that unlit materials show as white [default: 99.9 % of all surface is darker]
    #[arg(long, value_name = "W/m2/sr", value_parser = parse_scale)]
    pub scale: Option<f32>,
    /// Texels a side of the lightmap [default: as many as the scene's charts ask for, from 256]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(16..=2048))]
    pub lightmap_size: Option<u32>,
    /// Rays of each texel, for light by direction
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..=65_536))]
    pub directions: u32,
    /// Options of `linklight render`, such as -- --bounces 2 --elements 50000 --indirect-only
    #[arg(last = true, value_name = "RENDER OPTIONS")]
    pub options: Vec<String>,
}

/// What a baked scene carries its light in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum BakeForm {
    /// COLOR_0 and the attribute _IRRADIANCE (W/m2)
    VertexColors,
    /// A second UV set, and irradiance (W/m2) as .exr
    Lightmap,
    /// As lightmap, with the vector irradiance of each channel as layers of the .exr
    IrradianceVectors,
    /// As lightmap, with spherical harmonics of bands 0 and 1 as layers of the .exr
    SphericalHarmonics,
}

/// Materials of a baked scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum BakeMaterials {
    /// KHR_materials_unlit: the light can be seen in any viewer
    #[default]
    Unlit,
    /// The scene's own: for programs that apply the light themselves
    Original,
}

#[derive(Debug, Args)]
pub struct DivergeArgs {
    /// Hashes of one run
    #[arg(value_name = "A.json")]
    pub a: PathBuf,
    /// Hashes of another, by another driver or version
    #[arg(value_name = "B.json")]
    pub b: PathBuf,
    /// Hashes of the first run made again: what differs there has no order of its own and is passed over
    #[arg(long, value_name = "A2.json")]
    pub again: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Fail (exit code 1) if the runs differ
    #[arg(long)]
    pub fail: bool,
}

#[derive(Debug, Args)]
pub struct DiffArgs {
    /// The picture in question: PNG, EXR or HDR
    #[arg(value_name = "A")]
    pub picture: PathBuf,
    /// The reference it is held to, of the same kind and size
    #[arg(value_name = "B")]
    pub reference: PathBuf,
    /// Compare only where this picture is not black
    #[arg(long, value_name = "FILE")]
    pub mask: Option<PathBuf>,
    /// Compare this layer of two .exr files (direct, indirect, albedo, normal) in place of their RGB
    #[arg(long, value_name = "NAME")]
    pub layer: Option<String>,
    /// Write a heat map of the error
    #[arg(short, long, value_name = "FILE.png")]
    pub output: Option<PathBuf>,
    /// What the heat map shows
    #[arg(long, value_enum, default_value_t, requires = "output")]
    pub map: HeatMap,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Fail (exit code 1) if a figure is above this limit: rmse, relmse, energy (|ratio - 1|), p95, ssim (1 - SSIM),
    /// flip, flip-p95; may be repeated
    #[arg(long, value_name = "FIGURE=LIMIT")]
    pub fail_above: Vec<Limit>,
    /// Exposure in stops at which FLIP sees radiance
    #[arg(long, value_name = "EV", default_value_t = 0.0, value_parser = parse_exposure, allow_negative_numbers = true)]
    pub exposure: f32,
    /// Tone mapping through which FLIP sees radiance, fitted to B
    #[arg(long, value_enum, default_value_t)]
    pub tonemap: Operator,
}

/// Error maps of `diff`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum HeatMap {
    /// FLIP: what an observer notices
    #[default]
    Flip,
    /// Relative error of radiance, white at 100 %
    Relative,
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
