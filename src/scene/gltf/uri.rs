//! Where buffers and images come from: `data:` URIs and files beside the scene. Nothing else is ever opened.

use super::budget::Budget;
use super::error::{Fault, shown};
use crate::files::{self, File};
use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

/// Exporters disagree about padding, so either form is read.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// Reads what `uri`, found at `pointer`, stands for. `folder` is the scene file's own; embedded scenes have none.
pub fn read(uri: &str, pointer: &str, folder: Option<&Path>, budget: &Budget) -> Result<Vec<u8>, Fault> {
    match uri.strip_prefix("data:") {
        Some(data) => decode_data(data, pointer, budget),
        None => {
            let refused = |rule| Fault::RefusedUri { pointer: pointer.into(), uri: shown(uri), rule };
            let relative = relative_path(uri).map_err(refused)?;
            let folder = folder.ok_or_else(|| refused("an embedded scene cannot refer to files"))?;
            read_file(&folder.join(relative), budget)
        }
    }
}

fn decode_data(data: &str, pointer: &str, budget: &Budget) -> Result<Vec<u8>, Fault> {
    let broken = |seen: String| Fault::invalid(pointer, "must be a data URI with base64 data", seen);
    let (kind, data) = data.split_once(',').ok_or_else(|| broken("one without a comma".into()))?;
    if !kind.ends_with(";base64") {
        return Err(broken(format!("one of kind {}", shown(kind))));
    }
    budget.reserve(data.len() as u64 / 4 * 3 + 3, || format!("the data URI at {pointer}"))?;
    // Percent-encoding is allowed in any URI; hardly anyone uses it here.
    let decoded = match data.contains('%') {
        true => BASE64.decode(percent_decode_str(data).collect::<Vec<u8>>()),
        false => BASE64.decode(data),
    };
    decoded.map_err(|error| broken(format!("not decodable ({error})")))
}

/// The path that a relative URI names, within the folder it is relative to.
fn relative_path(uri: &str) -> Result<PathBuf, &'static str> {
    let scheme_end = uri.find([':', '/', '?', '#']).filter(|end| uri[*end..].starts_with(':'));
    if scheme_end.is_some() {
        return Err("only relative URIs and data URIs are allowed, not other schemes");
    }
    let decoded = percent_decode_str(uri).decode_utf8().map_err(|_| "it must be UTF-8 once percent-decoded")?;
    if decoded.is_empty() || decoded.contains(['\\', '\0']) {
        return Err("it must be a plain relative path with forward slashes");
    }
    let mut path = PathBuf::new();
    for component in Path::new(decoded.as_ref()).components() {
        match component {
            Component::Normal(name) => path.push(name),
            Component::CurDir => {}
            Component::ParentDir if path.pop() => {}
            Component::ParentDir => return Err("it must not leave the scene's folder"),
            Component::RootDir | Component::Prefix(_) => return Err("absolute paths are not allowed"),
        }
    }
    Ok(path)
}

/// Reads a plain file whose size is counted first. Pipes and devices, which may never end, are refused.
pub fn read_file(path: &Path, budget: &Budget) -> Result<Vec<u8>, Fault> {
    let what = || shown(&path.to_string_lossy());
    let unreadable = |reason: String| Fault::Unreadable { what: what(), reason };
    let metadata = files::metadata(path).map_err(|error| unreadable(error.to_string()))?;
    if !metadata.is_file() {
        return Err(unreadable("it is not a plain file".into()));
    }
    budget.reserve(metadata.len(), what)?;
    let mut bytes = Vec::with_capacity(metadata.len() as usize);
    let file = File::open(path).map_err(|error| unreadable(error.to_string()))?;
    // A file that grows meanwhile must not outgrow what was counted.
    file.take(metadata.len()).read_to_end(&mut bytes).map_err(|error| unreadable(error.to_string()))?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relative_uris_stay_inside_the_folder() {
        let path = |uri| relative_path(uri).map(|path| path.to_string_lossy().into_owned());
        assert_eq!(path("a%20b/c.png").unwrap(), "a b/c.png");
        assert_eq!(path("./a/../b.bin").unwrap(), "b.bin");
        assert_eq!(path("a/b:c.bin").unwrap(), "a/b:c.bin");
        for refused in [
            "",
            "../a",
            "a/../../b",
            "%2e%2e/a",
            "/etc/passwd",
            "%2Fetc/passwd",
            "file:a",
            "http://a/b",
            "C:/a",
            "a\\b",
            "a%00",
            "%ff",
        ] {
            assert!(path(refused).is_err(), "{refused}");
        }
    }

    #[test]
    fn data_uris_are_decoded_with_or_without_padding() {
        let budget = Budget::new(1000);
        let decode = |uri| read(uri, "/buffers/0/uri", None, &budget);
        assert_eq!(decode("data:application/octet-stream;base64,AQID").unwrap(), [1, 2, 3]);
        assert_eq!(decode("data:;base64,AQ==").unwrap(), [1]);
        assert_eq!(decode("data:;base64,AQ").unwrap(), [1]);
        assert_eq!(decode("data:;base64,AQ%3D%3D").unwrap(), [1]);
        assert!(decode("data:text/plain,hello").is_err());
        assert!(decode("data:;base64").is_err());
        assert!(decode("data:;base64,`").is_err());
        assert!(matches!(decode("beside.bin"), Err(Fault::RefusedUri { .. })));
    }

    #[test]
    fn data_uris_are_counted_before_they_are_decoded() {
        let uri = format!("data:;base64,{}", "A".repeat(4000));
        assert!(matches!(read(&uri, "", None, &Budget::new(2999)), Err(Fault::OverBudget { needed: 3003, .. })));
    }
}
