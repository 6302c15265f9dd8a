//! The `--profile` file: what every pass cost and what every part keeps in memory.
//!
//! # Schema, version 1
//!
//! One JSON object. Fields are only ever added within a version; a field that changes its meaning or leaves makes a
//! new one.
//!
//! | field | value |
//! |---|---|
//! | `schema` | `"linklight-profile"` |
//! | `version` | `1` |
//! | `program` | `{name, version}` |
//! | `device` | `{name, driver, kind, api}`: as the driver reports them; `kind` as `linklight devices` shows it |
//! | `scene` | `{name, triangles, elements, lights}` |
//! | `settings` | object: every option and method setting in force, by name |
//! | `frames` | frames measured; warm-up frames are not |
//! | `passes` | in order of first call: `{path, name, calls, ms, bytes_read, bytes_written, counters, overlapped}` |
//! | `passes[].path` | enclosing scopes and pass: `"frame/explicit-visibility/bounce 2/gather/links"`; each path once |
//! | `passes[].name` | the pass alone: `"gather/links"` |
//! | `passes[].calls` | over all frames |
//! | `passes[].ms` | `{min, median, max, total}` of one call on the GPU, milliseconds |
//! | `passes[].bytes_read`, `bytes_written` | sum over calls, as counted from the algorithm (not from the hardware) |
//! | `passes[].counters` | object: sum over calls, by name (`links made`, `nodes visited` ...) |
//! | `passes[].overlapped` | `true` if any call ran beside another pass: its times share the GPU |
//! | `method` | what the method counted, by its own names; `null` where it counts nothing |
//! | `total_ms` | sum of all passes, milliseconds |
//! | `memory` | `{bytes, peak_bytes, owners: [{owner, bytes, peak_bytes}]}`: GPU memory, largest peak first; the total peak is the sum of the owners', an upper bound |
//!
//! The structs below are the schema: they are written and read by the same declarations. Nothing here measures.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::write::{FileError, write_text};
use crate::files;

pub const SCHEMA: &str = "linklight-profile";
pub const VERSION: u32 = 1;

/// One call of one pass, as the GPU's timestamps saw it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PassRecord {
    /// Enclosing scopes and the pass, joined by slashes: `frame/explicit-visibility/bounce 2/gather/links`.
    pub path: String,
    /// The pass alone: `gather/links`, the end of `path`.
    pub name: String,
    /// Nanoseconds on the GPU's clock.
    pub start_ns: u64,
    pub end_ns: u64,
    /// Bytes as counted from the algorithm.
    pub bytes_read: u64,
    pub bytes_written: u64,
    /// What the pass counted, by name.
    pub counters: Vec<(String, u64)>,
    /// Whether it may have run beside another pass, for want of a barrier between them.
    pub overlapped: bool,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Profile {
    pub schema: String,
    pub version: u32,
    pub program: Program,
    pub device: Device,
    pub scene: SceneFacts,
    pub settings: Map<String, Value>,
    pub frames: u32,
    pub passes: Vec<Pass>,
    /// What the method counted.
    #[serde(default)]
    pub method: Value,
    pub total_ms: f64,
    pub memory: Memory,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Program {
    pub name: String,
    pub version: String,
}

/// The Vulkan device, in the driver's words.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Device {
    pub name: String,
    /// Name and version of the driver.
    pub driver: String,
    /// `discrete GPU`, `integrated GPU`, `virtual GPU`, `CPU` or `other`.
    pub kind: String,
    /// Vulkan version the device reports, `1.3.289`.
    pub api: String,
}

/// What was rendered, in numbers.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SceneFacts {
    pub name: String,
    pub triangles: u64,
    pub elements: u64,
    pub lights: u64,
}

/// All calls of one pass in the same scopes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pass {
    pub path: String,
    pub name: String,
    pub calls: u64,
    pub ms: Milliseconds,
    pub bytes_read: u64,
    pub bytes_written: u64,
    pub counters: Map<String, Value>,
    pub overlapped: bool,
}

/// Durations of the calls of a pass, milliseconds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Milliseconds {
    pub min: f64,
    /// The mean of the two middle calls where their number is even.
    pub median: f64,
    pub max: f64,
    pub total: f64,
}

#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Memory {
    pub bytes: u64,
    pub peak_bytes: u64,
    pub owners: Vec<MemoryOwner>,
}

/// What one part of the program allocated on the GPU.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MemoryOwner {
    pub owner: String,
    pub bytes: u64,
    pub peak_bytes: u64,
}

/// A profile file that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ProfileError {
    #[error(transparent)]
    File(#[from] FileError),
    #[error("{path} is not a profile: {reason}")]
    Content { path: String, reason: String },
    #[error("{path} is a profile of version {found}; this program reads version {VERSION}")]
    Version { path: String, found: u64 },
}

impl Profile {
    /// A profile of `frames` frames. Owners are sorted by peak, largest first.
    pub fn new(
        device: Device,
        scene: SceneFacts,
        settings: Map<String, Value>,
        frames: u32,
        records: &[PassRecord],
        mut memory: Memory,
    ) -> Self {
        memory.owners.sort_by(|a, b| b.peak_bytes.cmp(&a.peak_bytes).then_with(|| a.owner.cmp(&b.owner)));
        let passes = summarise(records);
        let program =
            Program { name: env!("CARGO_PKG_NAME").to_owned(), version: env!("CARGO_PKG_VERSION").to_owned() };
        let total_ms = passes.iter().map(|pass| pass.ms.total).sum();
        Self {
            schema: SCHEMA.to_owned(),
            version: VERSION,
            program,
            device,
            scene,
            settings,
            frames,
            passes,
            method: Value::Null,
            total_ms,
            memory,
        }
    }

    /// Write as indented JSON, whole or not at all.
    pub fn write(&self, path: &Path) -> Result<(), ProfileError> {
        let json = serde_json::to_string_pretty(self)
            .map_err(|error| ProfileError::Content { path: path.display().to_string(), reason: error.to_string() })?;
        Ok(write_text(path, &(json + "\n"))?)
    }

    /// Read a file that [`Profile::write`] wrote.
    pub fn read(path: &Path) -> Result<Self, ProfileError> {
        let text = files::read_to_string(path).map_err(|source| FileError::new("read", path, source))?;
        let content = |reason: String| ProfileError::Content { path: path.display().to_string(), reason };
        let value: Value = serde_json::from_str(&text).map_err(|error| content(error.to_string()))?;
        if value["schema"] != SCHEMA {
            return Err(content(format!("its \"schema\" is {}, not {SCHEMA:?}", value["schema"])));
        }
        match value["version"].as_u64() {
            Some(version) if version == u64::from(VERSION) => {}
            Some(found) => return Err(ProfileError::Version { path: path.display().to_string(), found }),
            None => return Err(content("it has no \"version\"".to_owned())),
        }
        serde_json::from_value(value).map_err(|error| content(error.to_string()))
    }
}

/// One [`Pass`] per path, in order of first call.
pub fn summarise(records: &[PassRecord]) -> Vec<Pass> {
    let mut groups: Vec<Vec<&PassRecord>> = Vec::new();
    let mut index_of = std::collections::HashMap::new();
    for record in records {
        let index = *index_of.entry(record.path.as_str()).or_insert_with(|| {
            groups.push(Vec::new());
            groups.len() - 1
        });
        groups[index].push(record);
    }
    groups.iter().filter_map(|calls| summarise_calls(calls)).collect()
}

/// `None` without calls.
fn summarise_calls(calls: &[&PassRecord]) -> Option<Pass> {
    let first = calls.first()?;
    let mut counters: Map<String, Value> = Map::new();
    for (counter, count) in calls.iter().flat_map(|call| &call.counters) {
        let sum = counters.get(counter).and_then(Value::as_u64).unwrap_or(0).saturating_add(*count);
        counters.insert(counter.clone(), sum.into());
    }
    Some(Pass {
        path: first.path.clone(),
        name: first.name.clone(),
        calls: calls.len() as u64,
        ms: Milliseconds::of(calls.iter().map(|call| call.end_ns.saturating_sub(call.start_ns)).collect()),
        bytes_read: calls.iter().map(|call| call.bytes_read).sum(),
        bytes_written: calls.iter().map(|call| call.bytes_written).sum(),
        counters,
        overlapped: calls.iter().any(|call| call.overlapped),
    })
}

impl Milliseconds {
    /// All zero where there are none.
    pub fn of(mut durations_ns: Vec<u64>) -> Self {
        durations_ns.sort_unstable();
        let ms = |ns: u64| ns as f64 * 1e-6;
        let (Some(first), Some(last)) = (durations_ns.first(), durations_ns.last()) else { return Self::default() };
        let count = durations_ns.len();
        let median = (ms(durations_ns[(count - 1) / 2]) + ms(durations_ns[count / 2])) / 2.0;
        Self { min: ms(*first), median, max: ms(*last), total: durations_ns.iter().map(|ns| ms(*ns)).sum() }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A call of `name` inside `scopes`.
    pub(in crate::report) fn record(scopes: &str, name: &str, start_ns: u64, end_ns: u64) -> PassRecord {
        let path = format!("{scopes}/{name}");
        PassRecord { path, name: name.to_owned(), start_ns, end_ns, ..PassRecord::default() }
    }

    fn sample() -> Profile {
        let mut records = vec![
            record("frame", "bvh/a", 0, 4_000_000),
            record("frame", "bvh/b", 4_000_000, 5_000_000),
            record("frame", "bvh/a", 5_000_000, 6_000_000),
            record("frame", "bvh/a", 6_000_000, 8_000_000),
            record("frame", "bvh/a", 8_000_000, 16_000_000),
        ];
        for (index, record) in records.iter_mut().enumerate() {
            record.bytes_read = 100;
            record.bytes_written = index as u64;
            record.counters = vec![("links made".to_owned(), 7)];
        }
        records[3].overlapped = true;
        let owner = |owner: &str, peak_bytes| MemoryOwner { owner: owner.to_owned(), bytes: 1, peak_bytes };
        let memory = Memory { bytes: 2, peak_bytes: 30, owners: vec![owner("links", 10), owner("bvh", 20)] };
        Profile::new(Device::default(), SceneFacts::default(), Map::new(), 4, &records, memory)
    }

    #[test]
    fn calls_of_a_name_become_one_pass() {
        let profile = sample();
        assert_eq!(profile.passes.len(), 2);
        let pass = &profile.passes[0];
        assert_eq!((pass.path.as_str(), pass.name.as_str()), ("frame/bvh/a", "bvh/a"));
        assert_eq!((pass.calls, pass.bytes_read, pass.bytes_written), (4, 400, 9));
        assert_eq!((pass.ms.min, pass.ms.median, pass.ms.max, pass.ms.total), (1.0, 3.0, 8.0, 15.0));
        assert_eq!(pass.counters["links made"], 28);
        assert!(pass.overlapped && !profile.passes[1].overlapped);
        assert_eq!(profile.total_ms, 16.0);
        assert_eq!(profile.memory.owners[0].owner, "bvh");
    }

    #[test]
    fn a_timestamp_that_runs_backwards_counts_as_no_time() {
        assert_eq!(summarise(&[record("frame", "a", 5, 3)])[0].ms, Milliseconds::default());
        assert!(summarise(&[]).is_empty());
    }

    #[test]
    fn a_file_reads_back_and_others_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.json");
        let profile = sample();
        profile.write(&path).unwrap();
        assert_eq!(Profile::read(&path).unwrap(), profile);

        let refusal = |text: &str| {
            std::fs::write(&path, text).unwrap();
            Profile::read(&path).unwrap_err().to_string()
        };
        assert!(refusal("[").contains("is not a profile"));
        assert!(refusal("{}").contains("its \"schema\" is null"));
        assert!(refusal("{\"schema\": \"linklight-profile\"}").contains("no \"version\""));
        assert!(refusal("{\"schema\": \"linklight-profile\", \"version\": 9}").contains("version 9"));
        assert!(refusal("{\"schema\": \"linklight-profile\", \"version\": 1}").contains("missing field"));
        assert!(matches!(Profile::read(&folder.path().join("none.json")), Err(ProfileError::File(_))));
    }
}
