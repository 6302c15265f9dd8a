//! The file of `linklight bench`: times of frames and passes with all single values, and the yardsticks of the same run.
//!
//! # Schema, version 1
//!
//! The structs below are the schema: `schema` is `"linklight-bench"`; fields are only added within a version. Times are
//! milliseconds: of a frame on the CPU's clock until the GPU is idle, of passes on the GPU's. Every list of values is in
//! the order of the rounds, so that values of one index were measured side by side.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::profile::Device;
use super::statistics::{Estimate, Shift, Verdict};
use super::write::{FileError, write_text};
use crate::files;

pub const SCHEMA: &str = "linklight-bench";
pub const VERSION: u32 = 1;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BenchFile {
    pub schema: String,
    pub version: u32,
    pub program: String,
    /// Variables of the environment that change what drivers do, where set.
    pub environment: BTreeMap<String, String>,
    pub rounds: u32,
    pub warm_up: WarmUp,
    /// By device, of the same rounds.
    pub yardsticks: Vec<Yardsticks>,
    pub subjects: Vec<Subject>,
}

/// How the times settled before any was kept.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct WarmUp {
    pub rounds: u32,
    /// Share by which the medians of the last two windows of rounds differed, of the subject where it was largest.
    pub drift: f64,
    /// Whether that is small enough; a run that never settled says so.
    pub settled: bool,
}

/// What the machine can do, measured beside the subjects: one value a round.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Yardsticks {
    pub device: Device,
    /// Bytes that one device copy reads and writes.
    pub copy_bytes: u64,
    pub copy_ms: Vec<f64>,
    /// Flops of one multiply-add dispatch.
    pub multiply_add_flops: u64,
    pub multiply_add_ms: Vec<f64>,
    /// A submission of one dispatch that does nothing, until idle.
    pub empty_ms: Vec<f64>,
    /// A fixed loop of multiply-adds on one CPU thread.
    pub cpu_ms: Vec<f64>,
}

/// One method with its settings on one scene and device.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Subject {
    pub scene: String,
    /// Of the scene's files.
    pub scene_hash: String,
    pub method: String,
    pub variation: String,
    /// The command that renders it.
    pub command: String,
    pub settings: Map<String, Value>,
    /// Index into [`BenchFile::yardsticks`].
    pub device: usize,
    pub prepare_ms: f64,
    pub frame: Times,
    pub passes: Vec<PassTimes>,
    /// Times as long as the first subject of the file, where this is another.
    pub against_first: Option<Comparison>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Times {
    #[serde(flatten)]
    pub estimate: Estimate,
    pub values: Vec<f64>,
}

/// All calls of one pass in a frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PassTimes {
    pub path: String,
    pub times: Times,
    /// By the algorithm, in a frame.
    pub bytes: u64,
    /// Of the bandwidth that the copy reached in the same rounds. The roofline's other side, arithmetic, has no share here:
    /// no Vulkan query counts a pass's operations, and counting instructions in its shader would guess at its loops and
    /// branches. A pass with a small share is bound by arithmetic, latency or dispatches; `yardsticks` holds the rates of
    /// the first and the last.
    pub bandwidth_share: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    #[serde(flatten)]
    pub shift: Shift,
    pub verdict: Verdict,
}

impl From<Shift> for Comparison {
    fn from(shift: Shift) -> Self {
        Self { shift, verdict: shift.verdict() }
    }
}

#[derive(Debug, thiserror::Error)]
pub enum BenchFileError {
    #[error(transparent)]
    File(#[from] FileError),
    #[error("{path} is no bench file of version {VERSION}: {reason}; make one with `linklight bench -o`")]
    Format { path: String, reason: String },
    #[error("a measurement cannot be written as JSON: {0}")]
    Json(#[from] serde_json::Error),
}

impl BenchFile {
    pub fn write(&self, path: &Path) -> Result<(), BenchFileError> {
        Ok(write_text(path, &serde_json::to_string_pretty(self)?)?)
    }

    /// Refuses other schemas and versions, and times that no clock gives.
    pub fn read(path: &Path) -> Result<Self, BenchFileError> {
        let text = files::read_to_string(path).map_err(|source| FileError::new("read", path, source))?;
        let refuse = |reason: String| BenchFileError::Format { path: path.display().to_string(), reason };
        let value: Value = serde_json::from_str(&text).map_err(|error| refuse(error.to_string()))?;
        if value["schema"] != SCHEMA || value["version"] != VERSION {
            return Err(refuse(format!("schema {}, version {}", value["schema"], value["version"])));
        }
        let file: Self = serde_json::from_value(value).map_err(|error| refuse(error.to_string()))?;
        let bad = file.all_times().find(|ms| !(ms.is_finite() && *ms >= 0.0));
        match bad {
            Some(bad) => Err(refuse(format!("a time of {bad} ms"))),
            None => Ok(file),
        }
    }

    fn all_times(&self) -> impl Iterator<Item = f64> {
        let subjects = self.subjects.iter().flat_map(|s| s.passes.iter().map(|p| &p.times).chain([&s.frame]));
        let yardsticks = self.yardsticks.iter().flat_map(|y| [&y.copy_ms, &y.multiply_add_ms, &y.empty_ms, &y.cpu_ms]);
        subjects.map(|times| &times.values).chain(yardsticks).flatten().copied()
    }
}
