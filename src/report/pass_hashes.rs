//! The `--hashes` file: what every pass of a run left in its buffers, and where two such runs first part.
//!
//! # Schema, version 1
//!
//! The structs below are the schema: `schema` is `"linklight-hashes"`; fields are only added within a version. Passes stand
//! in the order in which they ran; a buffer that a pass writes has one hash for each of at most 256 blocks.

use std::collections::HashMap;
use std::fmt;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::profile::Device;
use super::write::{FileError, write_text};
use crate::files;

pub const SCHEMA: &str = "linklight-hashes";
pub const VERSION: u32 = 1;
const WORD_BYTES: u64 = 4;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HashFile {
    pub schema: String,
    pub version: u32,
    pub program: String,
    pub device: Device,
    pub scene: String,
    pub settings: Map<String, Value>,
    pub passes: Vec<PassHash>,
}

/// What a pass left in one of its buffers.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct PassHash {
    pub path: String,
    /// The binding's name in the shader.
    pub binding: String,
    pub bytes: u64,
    pub bytes_per_block: u64,
    pub blocks: Vec<u32>,
}

#[derive(Debug, thiserror::Error)]
pub enum HashFileError {
    #[error(transparent)]
    File(#[from] FileError),
    #[error(
        "{path} is no file of pass hashes of version {VERSION}: {reason}; make one with `linklight render --hashes`"
    )]
    Format { path: String, reason: String },
    #[error("hashes cannot be written as JSON: {0}")]
    Json(#[from] serde_json::Error),
}

/// The first pass of two runs whose outputs differ.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Divergence {
    pub path: String,
    /// Which of the calls of that path, from 1.
    pub call: usize,
    pub binding: String,
    pub what: Difference,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Difference {
    /// Bytes from `first` on, up to `end`, in the first block that differs; so many of all blocks do.
    Content {
        first: u64,
        end: u64,
        blocks: usize,
        of_blocks: usize,
    },
    Size {
        a: u64,
        b: u64,
    },
    /// The other run did something else at this place.
    Pass {
        other: String,
    },
    /// The other run ended.
    End,
}

impl HashFile {
    pub fn write(&self, path: &Path) -> Result<(), HashFileError> {
        Ok(write_text(path, &serde_json::to_string(self)?)?)
    }

    /// Refuses other schemas and versions.
    pub fn read(path: &Path) -> Result<Self, HashFileError> {
        let fail = |reason: String| HashFileError::Format { path: path.display().to_string(), reason };
        let text = files::read_to_string(path).map_err(|source| FileError::new("read", path, source))?;
        let file: Self = serde_json::from_str(&text).map_err(|error| fail(error.to_string()))?;
        if file.schema != SCHEMA || file.version != VERSION {
            return Err(fail(format!("its schema is {:?}, version {}", file.schema, file.version)));
        }
        Ok(file)
    }

    /// Where two runs first part. What differs between `self` and `again`, another run of the same, has no order of its
    /// own (queues filled by atomics) and is not looked at.
    pub fn first_difference(&self, other: &Self, again: Option<&Self>) -> Option<Divergence> {
        let mut calls: HashMap<(&str, &str), usize> = HashMap::new();
        for (index, pass) in self.passes.iter().enumerate() {
            let call = calls.entry((&pass.path, &pass.binding)).or_default();
            *call += 1;
            let unstable = again.is_some_and(|again| again.passes.get(index) != Some(pass));
            let found = match other.passes.get(index) {
                None => Some(Difference::End),
                Some(b) if (&b.path, &b.binding) != (&pass.path, &pass.binding) => {
                    Some(Difference::Pass { other: format!("{} ({})", b.path, b.binding) })
                }
                Some(_) if unstable => None,
                Some(b) => pass.difference(b),
            };
            if let Some(what) = found {
                let (path, binding) = (pass.path.clone(), pass.binding.clone());
                return Some(Divergence { path, call: *call, binding, what });
            }
        }
        let next = other.passes.get(self.passes.len())?;
        let (path, binding) = (next.path.clone(), next.binding.clone());
        Some(Divergence { path, call: 1, binding, what: Difference::End })
    }
}

impl PassHash {
    fn difference(&self, other: &Self) -> Option<Difference> {
        if self.bytes != other.bytes {
            return Some(Difference::Size { a: self.bytes, b: other.bytes });
        }
        let differs = |block: &usize| self.blocks.get(*block) != other.blocks.get(*block);
        let count = self.blocks.len().max(other.blocks.len());
        let first = ((0..count).find(differs)? as u64).saturating_mul(self.bytes_per_block);
        Some(Difference::Content {
            first,
            end: first.saturating_add(self.bytes_per_block).min(self.bytes),
            blocks: (0..count).filter(differs).count(),
            of_blocks: count,
        })
    }

    /// As the GPU layer counts: in words.
    pub fn of_words(path: String, binding: &str, words: u32, words_per_block: u32, blocks: Vec<u32>) -> Self {
        let (bytes, bytes_per_block) = (u64::from(words) * WORD_BYTES, u64::from(words_per_block) * WORD_BYTES);
        Self { path, binding: binding.to_owned(), bytes, bytes_per_block, blocks }
    }
}

impl fmt::Display for Divergence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { path, call, binding, what } = self;
        write!(f, "{path}, call {call}, buffer {binding}: ")?;
        match what {
            Difference::Content { first, end, blocks, of_blocks } => {
                write!(f, "first in bytes {first} to {end}; {blocks} of {of_blocks} blocks differ")
            }
            Difference::Size { a, b } => write!(f, "{a} bytes in one run, {b} in the other"),
            Difference::Pass { other } => write!(f, "the other run did {other} in its place"),
            Difference::End => write!(f, "one of the runs has no such pass"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(blocks: &[(&str, &[u32])]) -> HashFile {
        let pass = |(path, blocks): &(&str, &[u32])| {
            PassHash::of_words((*path).to_owned(), "out", 4 * blocks.len() as u32 - 1, 4, blocks.to_vec())
        };
        HashFile {
            schema: SCHEMA.into(),
            version: VERSION,
            program: "linklight".into(),
            device: Device::default(),
            scene: "a".into(),
            settings: Map::new(),
            passes: blocks.iter().map(pass).collect(),
        }
    }

    #[test]
    fn the_first_pass_that_differs_is_named_with_its_place() {
        let a = file(&[("x", &[1, 2]), ("y", &[3, 4, 5]), ("x", &[6])]);
        assert_eq!(a.first_difference(&a, None), None);
        let b = file(&[("x", &[1, 2]), ("y", &[3, 9, 8]), ("x", &[7])]);
        let found = a.first_difference(&b, None).unwrap();
        assert_eq!((found.path.as_str(), found.call), ("y", 1));
        assert_eq!(found.what, Difference::Content { first: 16, end: 32, blocks: 2, of_blocks: 3 });
        assert!(found.to_string().contains("bytes 16 to 32"), "{found}");
    }

    #[test]
    fn what_differs_from_run_to_run_anyway_is_passed_over() {
        let a = file(&[("x", &[1]), ("y", &[3]), ("y", &[4])]);
        let again = file(&[("x", &[1]), ("y", &[5]), ("y", &[4])]);
        let b = file(&[("x", &[1]), ("y", &[6]), ("y", &[7])]);
        assert_eq!(a.first_difference(&b, None).unwrap().call, 1);
        assert_eq!(a.first_difference(&b, Some(&again)).unwrap().call, 2);
    }

    #[test]
    fn missing_and_other_passes_are_told() {
        let a = file(&[("x", &[1]), ("y", &[3])]);
        let shorter = file(&[("x", &[1])]);
        assert_eq!(a.first_difference(&shorter, None).unwrap().what, Difference::End);
        assert_eq!(shorter.first_difference(&a, None).unwrap().path, "y");
        let other = file(&[("x", &[1]), ("z", &[3])]);
        assert!(matches!(a.first_difference(&other, None).unwrap().what, Difference::Pass { .. }));
        let larger = file(&[("x", &[1, 2]), ("y", &[3])]);
        assert_eq!(a.first_difference(&larger, None).unwrap().what, Difference::Size { a: 12, b: 28 });
    }
}
