//! The command line of what measures, compares and bakes, declared for clap.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::compare::Variation;
use super::diff::Limit;
use super::values::{
    SceneSource, parse_exposure, parse_fraction, parse_glb, parse_measuring_seconds, parse_method, parse_scale,
    parse_wall,
};
use crate::methods::Method;
use crate::methods::settings::Assignment;
use crate::report::tonemap::Operator;

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
    /// Only rows whose place ("Table 1"), words or scene contain this text; a number counts whole
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
    /// Write times, bytes and counters of every pass as JSON
    #[arg(long, value_name = "FILE.json")]
    pub profile: Option<PathBuf>,
    /// Write a time line of CPU and GPU for Perfetto or chrome://tracing
    #[arg(long, value_name = "FILE.trace.json")]
    pub trace: Option<PathBuf>,
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
