//! From bytes to JSON and the embedded binary chunk: the .glb container, JSON parsing, version and extension checks.

use super::budget::Budget;
use super::error::{Fault, shown};
use super::json::Object;
use super::notes::Notes;
use serde_json::Value;

/// Extensions that are read. A file that requires another is refused; one that merely uses another gets a note.
pub const SUPPORTED_EXTENSIONS: [&str; 7] = [
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

const GLB_MAGIC: &[u8] = b"glTF";
const HEADER_BYTES: usize = 12;
const CHUNK_HEADER_BYTES: usize = 8;
const JSON_CHUNK: u32 = u32::from_le_bytes(*b"JSON");
const BINARY_CHUNK: u32 = u32::from_le_bytes(*b"BIN\0");

/// The two parts of a glTF file.
#[derive(Debug)]
pub struct Container<'a> {
    pub json: &'a [u8],
    /// The .glb's binary chunk: the data of a first buffer without a URI.
    pub binary: Option<&'a [u8]>,
}

/// Splits a file into its parts: a .glb by its magic number, anything else is taken as the JSON of a .gltf.
pub fn split<'a>(bytes: &'a [u8], notes: &Notes) -> Result<Container<'a>, Fault> {
    match bytes.starts_with(GLB_MAGIC) {
        true => split_glb(bytes, notes),
        false => Ok(Container { json: bytes, binary: None }),
    }
}

fn split_glb<'a>(bytes: &'a [u8], notes: &Notes) -> Result<Container<'a>, Fault> {
    let broken = |rule, seen| Fault::Container { rule, seen };
    let (Some(version), Some(length)) = (word(bytes, 4), word(bytes, 8)) else {
        return Err(broken("its header has 12 bytes", format!("the file has {}", bytes.len())));
    };
    if version != 2 {
        return Err(Fault::Version { seen: version.to_string() });
    }
    let length = length as usize;
    if length < HEADER_BYTES || length > bytes.len() {
        let rule = "the length in its header covers the header and lies within the file";
        return Err(broken(rule, format!("it says {length} and the file has {} bytes", bytes.len())));
    }
    if length < bytes.len() {
        notes.say(format!("{} bytes after the end of the .glb container were ignored.", bytes.len() - length));
    }

    let bytes = &bytes[..length];
    let mut container = Container { json: &[], binary: None };
    let mut offset = HEADER_BYTES;
    let mut chunk_index = 0;
    while offset < length {
        let (Some(chunk_length), Some(kind)) = (word(bytes, offset), word(bytes, offset + 4)) else {
            return Err(broken("a chunk header has 8 bytes", format!("{} remain at byte {offset}", length - offset)));
        };
        let start = offset + CHUNK_HEADER_BYTES;
        let end = start.checked_add(chunk_length as usize).filter(|end| *end <= length).ok_or_else(|| {
            let seen = format!("chunk {chunk_index} says {chunk_length} bytes and {} remain", length - start);
            broken("chunks lie within the container", seen)
        })?;
        match (chunk_index, kind) {
            (0, JSON_CHUNK) => container.json = &bytes[start..end],
            (0, _) => return Err(broken("its first chunk is the JSON", format!("it has the type 0x{kind:08x}"))),
            (1, BINARY_CHUNK) => container.binary = Some(&bytes[start..end]),
            (_, JSON_CHUNK | BINARY_CHUNK) => {
                let seen = format!("chunk {chunk_index} is a further one");
                return Err(broken("it has one JSON chunk, then at most one binary chunk", seen));
            }
            _ => notes.say(format!("The .glb chunk of unknown type 0x{kind:08x} was ignored.")),
        }
        if chunk_length % 4 != 0 {
            notes.say("A .glb chunk whose length is not a multiple of 4 was read all the same.");
        }
        offset = end;
        chunk_index += 1;
    }
    match chunk_index {
        0 => Err(broken("its first chunk is the JSON", "it has no chunk".into())),
        _ => Ok(container),
    }
}

fn word(bytes: &[u8], offset: usize) -> Option<u32> {
    let word = bytes.get(offset..offset.checked_add(4)?)?;
    Some(u32::from_le_bytes(word.try_into().ok()?))
}

/// Parses the JSON, counting the tree that it becomes against the budget beforehand. Nesting is limited by the parser.
pub fn parse(json: &[u8], budget: &Budget, notes: &Notes) -> Result<Value, Fault> {
    let json = match json.strip_prefix(b"\xef\xbb\xbf") {
        Some(rest) => {
            notes.say("The byte order mark before the JSON was ignored.");
            rest
        }
        None => json,
    };
    if json.iter().all(u8::is_ascii_whitespace) {
        return Err(Fault::Json { reason: "it is empty".into() });
    }
    // Every value but the first follows one of these, so this bounds the number of tree entries from above.
    const ENTRY_BYTES: u64 = 96;
    let entries = json.iter().filter(|byte| matches!(byte, b',' | b':' | b'[' | b'{')).count() as u64 + 1;
    budget.reserve(json.len() as u64 + entries * ENTRY_BYTES, || "the parsed JSON".into())?;
    serde_json::from_slice(json).map_err(|error| Fault::Json { reason: error.to_string() })
}

/// Refuses what is not glTF 2.0, and what needs more than 2.0 offers.
pub fn check_version(root: &Object, notes: &Notes) -> Result<(), Fault> {
    let Some(asset) = root.object("asset")? else {
        // glTF 1.0 kept its collections in objects, and was often written without an asset.
        let old = ["accessors", "meshes", "nodes"].iter().any(|key| matches!(root.object(key), Ok(Some(_))));
        return match old {
            true => Err(Fault::Version { seen: "1.0 (its collections are objects and it has no asset)".into() }),
            false => Err(root.invalid("asset", "is required")),
        };
    };
    let version = asset.require("version", asset.text("version")?)?;
    match parse_version(version) {
        None => Err(asset.invalid("version", "must be of the form major.minor")),
        Some((2, 0)) => Ok(()),
        Some((2, _)) => match asset.text("minVersion")?.map(|text| (text, parse_version(text))) {
            None | Some((_, Some((2, 0)))) => {
                notes.say(format!("The file is glTF {}; it was read as 2.0.", shown(version)));
                Ok(())
            }
            Some((_, None)) => Err(asset.invalid("minVersion", "must be of the form major.minor")),
            Some((minimum, _)) => Err(Fault::Version { seen: shown(minimum) }),
        },
        Some(_) => Err(Fault::Version { seen: shown(version) }),
    }
}

fn parse_version(text: &str) -> Option<(u32, u32)> {
    let (major, minor) = text.split_once('.')?;
    Some((major.parse().ok()?, minor.parse().ok()?))
}

/// Refuses required extensions that are not supported, by name, and notes optional ones.
pub fn check_extensions(root: &Object, notes: &Notes) -> Result<(), Fault> {
    let required = root.list("extensionsRequired")?.texts()?;
    let lacking: Vec<_> = required.iter().filter(|name| !SUPPORTED_EXTENSIONS.contains(name)).collect();
    if !lacking.is_empty() {
        let names = lacking.iter().take(8).map(|name| shown(name)).collect::<Vec<_>>().join(", ");
        return Err(Fault::required_extension(root.at("extensionsRequired"), names));
    }
    for name in root.list("extensionsUsed")?.texts()? {
        if !SUPPORTED_EXTENSIONS.contains(&name) {
            notes.say(format!("The optional extension {} is not supported and was ignored.", shown(name)));
        }
    }
    Ok(())
}
