//! Why a scene could not be loaded: one type, whose message says where, which rule, what was seen and what to do.

use std::fmt;
use thiserror::Error;

/// A scene that could not be loaded: which file, and why.
#[derive(Debug, Error)]
#[error("{file}: {fault}")]
pub struct SceneError {
    /// The path as given, or the name of embedded data.
    pub file: String,
    pub fault: Fault,
}

/// What is wrong with a glTF file. Pointers are JSON pointers (RFC 6901) into its JSON, such as
/// `/accessors/3/byteOffset`.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Fault {
    #[error("cannot read {what}: {reason}; check that it exists, is a plain file and may be read")]
    Unreadable { what: String, reason: String },

    #[error(
        "the .glb container is broken: {rule}, but {seen}; the file is damaged or cut short, copy or export it again"
    )]
    Container { rule: &'static str, seen: String },

    #[error("the JSON cannot be parsed: {reason}; the file is damaged or is not glTF")]
    Json { reason: String },

    #[error(
        "{pointer}: {rule}, but it is {seen}; the file is not valid glTF 2.0, export it again or run the Khronos glTF validator on it"
    )]
    Invalid { pointer: String, rule: String, seen: String },

    #[error("the file is glTF {seen}, and only version 2.0 can be read; convert it to glTF 2.0")]
    Version { seen: String },

    #[error(
        "/extensionsRequired: the file needs {names}, which is not supported; supported are {supported}; export it without"
    )]
    RequiredExtension { pointer: String, names: String, supported: String },

    #[error("{pointer}: the URI {uri} is refused: {rule}; put the data beside the scene file, or embed it")]
    RefusedUri { pointer: String, uri: String, rule: &'static str },

    #[error(
        "{what}: {needed} bytes are needed and {available} are available of the scene's memory budget; raise it (--max-memory) or simplify the scene"
    )]
    OverBudget { what: String, needed: u64, available: u64 },

    #[error("{pointer}: {rule}, but it is {seen}; make it smaller or split it")]
    TooLarge { pointer: String, rule: String, seen: String },

    #[error("no scene {wanted}; the file has {available}")]
    NoSuchScene { wanted: String, available: String },
}

impl Fault {
    pub(super) fn invalid(pointer: impl Into<String>, rule: impl Into<String>, seen: impl fmt::Display) -> Self {
        Self::Invalid { pointer: pointer.into(), rule: rule.into(), seen: seen.to_string() }
    }

    pub(super) fn required_extension(pointer: impl Into<String>, names: String) -> Self {
        let supported = super::container::SUPPORTED_EXTENSIONS.join(", ");
        Self::RequiredExtension { pointer: pointer.into(), names, supported }
    }

    pub(super) fn too_large(pointer: impl Into<String>, rule: impl Into<String>, seen: impl fmt::Display) -> Self {
        Self::TooLarge { pointer: pointer.into(), rule: rule.into(), seen: seen.to_string() }
    }
}

/// Longest piece of the file's own text that a message repeats.
const SHOWN_CHARS: usize = 80;

/// Text of the file, made safe to print: quoted, control characters escaped, cut to a bounded length.
pub(super) fn shown(text: &str) -> String {
    match text.char_indices().nth(SHOWN_CHARS) {
        Some((end, _)) => format!("{:?}...", &text[..end]),
        None => format!("{text:?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shown_text_is_bounded_and_escaped() {
        assert_eq!(shown("a\u{1b}[2J"), "\"a\\u{1b}[2J\"");
        assert!(shown(&"é".repeat(1 << 20)).chars().count() < SHOWN_CHARS + 6);
    }
}
