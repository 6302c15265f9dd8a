//! The crash file: what is known when a GPU is lost, written whole before anything else is tried.
//!
//! ```json
//! { "schema": "linklight-crash", "version": 1, "program": "linklight 0.1.0", "unix_ms": 1790000000000,
//!   "error": "the device was lost in `frame/explicit-visibility/bounce 2/gather/links` ...", "is_provoked": false,
//!   "device": { "name": ..., "driver": ..., "kind": ..., "api": ... },
//!   "queues": [ { "name": "graphics and compute", "written_by": "vkCmdFillBuffer", "passes": 31, "begun": ...,
//!                 "ended": ..., "running": [ ... ] } ],
//!   "fault": { "description": ..., "addresses": [ ... ], "vendor": [ ... ] },
//!   "settings": { ... }, "command": "linklight render ..." }
//! ```
//!
//! `begun` and `ended` are the last passes of the submission that did so, null for none; `running` are those between.
//! `fault` is null where the driver tells nothing. Paths of passes are those of `--profile`.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use serde_json::{Map, Value, json};

use super::cli::Global;
use super::measure;
use super::render::cache_folder;
use crate::gpu::{Fault, Loss, LossHook};
use crate::report::write::{FileError, write_text};

const SCHEMA: &str = "linklight-crash";
const VERSION: u32 = 1;

/// Writes the crash file of the global options when the GPU is lost. `settings` decide the picture; `command` shows it
/// again, and may change while the program runs.
pub fn hook(
    global: &Global,
    settings: Map<String, Value>,
    command: impl Fn() -> String + Send + Sync + 'static,
) -> LossHook {
    let wanted = global.crash_file.clone();
    LossHook(Arc::new(move |loss| {
        let path = wanted.clone().unwrap_or_else(default_path);
        match write(&path, loss, &settings, &command()) {
            Ok(()) => tracing::error!("what is known of it is written to {}", path.display()),
            Err(error) => tracing::error!("nothing is written of it: {error}"),
        }
    }))
}

/// The command line of this process, to be pasted into a shell; without the switch that provoked the loss.
pub fn own_command() -> String {
    let words: Vec<String> = std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
    let mut kept = vec!["linklight".to_owned()];
    let mut rest = words.into_iter().skip(1);
    while let Some(word) = rest.next() {
        match word.as_str() {
            "--lose-device-at" => drop(rest.next()),
            other if other.starts_with("--lose-device-at=") => {}
            _ => kept.push(quoted(&word)),
        }
    }
    kept.join(" ")
}

/// A word as a POSIX shell reads it back.
pub fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "-_./:=,+@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

fn default_path() -> PathBuf {
    let folder = cache_folder().filter(|folder| std::fs::create_dir_all(folder).is_ok());
    folder.unwrap_or_else(std::env::temp_dir).join(format!("crash-{}.json", now()))
}

/// Milliseconds since 1970.
fn now() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_millis() as u64)
}

fn write(path: &Path, loss: &Loss, settings: &Map<String, Value>, command: &str) -> Result<(), FileError> {
    let Loss { error, device, is_provoked, queue, fault } = loss;
    let file = json!({
        "schema": SCHEMA,
        "version": VERSION,
        "program": concat!("linklight ", env!("CARGO_PKG_VERSION")),
        "unix_ms": now(),
        "error": error,
        "is_provoked": is_provoked,
        "device": measure::device(device),
        "queues": [{
            "name": "graphics and compute",
            "written_by": queue.written_by,
            "passes": queue.passes,
            "begun": queue.begun,
            "ended": queue.ended,
            "running": queue.running,
        }],
        "fault": fault.as_ref().map(fault_json),
        "settings": settings,
        "command": command,
    });
    write_text(path, &format!("{file:#}\n"))
}

fn fault_json(fault: &Fault) -> Value {
    json!({
        "description": fault.description,
        "addresses": fault.addresses.iter().map(|(kind, at)| json!({ "kind": kind, "address": at })).collect::<Vec<_>>(),
        "vendor": fault.vendor.iter()
            .map(|(words, code, data)| json!({ "description": words, "code": code, "data": data }))
            .collect::<Vec<_>>(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_where_a_shell_would_split_them() {
        assert_eq!(quoted("--set=a,b"), "--set=a,b");
        assert_eq!(quoted("builtin:gallery?triangles=3"), "'builtin:gallery?triangles=3'");
        assert_eq!(quoted("it's a scene.glb"), r"'it'\''s a scene.glb'");
        assert_eq!(quoted(""), "''");
    }
}
