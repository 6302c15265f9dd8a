//! What `linklight compare` leaves: the data, and the page that shows it, which opens from disk.
//!
//! # Schema of `compare.json`, version 1
//!
//! The structs below are the schema: `schema` is `"linklight-compare"`; fields are only added within a version.
//! Files are named relative to the folder of the page. Times are milliseconds on the CPU's clock around work that ends
//! with the GPU idle; `passes` as in [`crate::report::profile`].

mod html;

use serde::Serialize;
use serde_json::Value;

use super::errors::ErrorFigures;
use super::profile::{Device, MemoryOwner, Milliseconds, Pass};

pub use html::to_html;

pub const SCHEMA: &str = "linklight-compare";
pub const VERSION: u32 = 1;

/// A whole comparison.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    pub schema: &'static str,
    pub version: u32,
    pub program: &'static str,
    pub device: Device,
    /// Compared, and the reference.
    pub methods: Vec<MethodReport>,
    pub scenes: Vec<SceneReport>,
}

/// A method in words.
#[derive(Debug, Clone, Serialize)]
pub struct MethodReport {
    pub key: &'static str,
    pub summary: &'static str,
    /// Authors, title and where it was published.
    pub source: String,
    pub doi: Option<&'static str>,
}

/// One scene by every method.
#[derive(Debug, Clone, Serialize)]
pub struct SceneReport {
    pub scene: String,
    pub reference: ReferenceReport,
    pub runs: Vec<RunReport>,
    /// Paths of another seed than the reference's, for ever longer: the yardstick.
    pub path_tracing: Vec<CurvePoint>,
}

#[derive(Debug, Clone, Serialize)]
pub struct ReferenceReport {
    /// Tone-mapped; its tone curve shows all pictures of the scene.
    pub png: String,
    /// Radiance.
    pub exr: String,
    /// `None` for a picture that was given.
    pub command: Option<String>,
    /// Standard error of a pixel as a fraction of the mean, where it is known.
    pub noise: Option<f64>,
    pub samples: Option<u32>,
    /// Mean radiance with 0, 1, 2 ... bounces, where it is known.
    pub bounce_means: Vec<f64>,
}

#[derive(Debug, Clone, Serialize)]
pub struct RunReport {
    pub method: &'static str,
    /// What sets it apart from the other runs of its method.
    pub variation: String,
    pub command: String,
    pub outcome: Outcome,
}

#[derive(Debug, Clone, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    Done(Box<Done>),
    /// Why there is no picture.
    Failed(String),
}

#[derive(Debug, Clone, Serialize)]
pub struct Done {
    pub png: String,
    pub exr: String,
    /// FLIP error map.
    pub flip: String,
    /// Relative error map, white at 100 %.
    pub relative: String,
    pub figures: ErrorFigures,
    pub cost: Cost,
    /// Energy of each bounce alone over the reference's; `None` where that is black or unknown. Empty where bounces cannot be
    /// told apart.
    pub bounce_energy: Vec<Option<f64>>,
    /// Bounces of the reference that the figures are of, where the method holds another number of them than was asked for:
    /// antiradiance's symmetric scheme takes one bounce on with each step.
    pub bounces_held: Option<u32>,
}

/// What a picture cost.
#[derive(Debug, Clone, Serialize)]
pub struct Cost {
    /// Once per scene and pose.
    pub prepare_ms: f64,
    pub frame_ms: Milliseconds,
    /// Device memory at its highest.
    pub peak_bytes: u64,
    pub triangles: u64,
    pub elements: u64,
    /// Of the timed frames.
    pub passes: Vec<Pass>,
    /// Of placing the scene and of the timed preparation.
    pub prepare_passes: Vec<Pass>,
    /// Device memory by owner.
    pub memory: Vec<MemoryOwner>,
    /// The method's own report.
    pub facts: Value,
}

/// The path tracer after so many samples.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CurvePoint {
    pub samples: u32,
    pub milliseconds: f64,
    pub figures: ErrorFigures,
}
