//! glTF 2.0 in: `.gltf` and `.glb` files, read into the plain types of [`crate::scene`].
//!
//! Every count, offset, index and number of the file is checked where it is read (`json`, `accessor`); everything
//! decoded is counted against a budget first (`budget`); whatever can be left out without changing what the scene is
//! (a missing texture, an unknown optional extension) is left out with a note. Only what the chosen scene uses is read.
//!
//! The JSON is read through checked accessors rather than through the `gltf` crate's types: those index without asking
//! (panics), want what glTF leaves optional, and refuse what it allows (`"count": 3.0`).

mod accessor;
mod animation;
mod assemble;
mod budget;
mod camera;
mod container;
mod document;
mod error;
mod image;
mod json;
mod light;
mod material;
mod mesh;
mod node;
mod notes;
mod skin;
mod surface;
mod tangent;
mod texture;
mod topology;
mod uri;
pub mod write;
pub mod write_materials;

pub use error::{Fault, SceneError};

use super::Scene;
use budget::Budget;
use document::Document;
use json::Object;
use notes::Notes;
use std::convert::Infallible;
use std::path::Path;
use std::str::FromStr;

/// How to load a scene.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LoadOptions {
    /// Which of the file's scenes; `None` takes its default scene, or its first where it names no default.
    pub scene: Option<SceneChoice>,
    /// The most bytes that loading may take at a time: file, decoded data and what is computed from it.
    pub max_memory_bytes: u64,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self { scene: None, max_memory_bytes: 4 << 30 }
    }
}

/// One of a file's scenes, by its place (from 0) or its name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SceneChoice {
    Index(usize),
    Name(String),
}

impl FromStr for SceneChoice {
    type Err = Infallible;

    fn from_str(text: &str) -> Result<Self, Infallible> {
        Ok(text.parse().map_or_else(|_| Self::Name(text.to_owned()), Self::Index))
    }
}

/// Loads a `.gltf` or `.glb` file. Buffers and images may be embedded or stand in files in or below its folder.
///
/// # Errors
/// Files that cannot be read, are not valid glTF 2.0 where it matters, need an unsupported extension, or do not fit the
/// memory budget.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Scene, SceneError> {
    let file = path.display().to_string();
    let budget = Budget::new(options.max_memory_bytes);
    let folder = path.parent().unwrap_or(Path::new(""));
    let scene = uri::read_file(path, &budget).and_then(|bytes| read(&bytes, Some(folder), options, &budget));
    match scene {
        Ok(mut scene) => {
            if scene.name.is_empty() {
                scene.name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
            }
            Ok(scene)
        }
        Err(fault) => Err(SceneError { file, fault }),
    }
}

/// Loads a scene from memory, with default options. It must be self-contained: it cannot refer to files.
///
/// # Errors
/// As [`load`].
pub fn load_bytes(name: &str, bytes: &[u8]) -> Result<Scene, SceneError> {
    load_bytes_with(name, bytes, &LoadOptions::default())
}

/// Loads a scene from memory. It must be self-contained: it cannot refer to files.
///
/// # Errors
/// As [`load`].
pub fn load_bytes_with(name: &str, bytes: &[u8], options: &LoadOptions) -> Result<Scene, SceneError> {
    let budget = Budget::new(options.max_memory_bytes);
    match read(bytes, None, options, &budget) {
        Ok(scene) if scene.name.is_empty() => Ok(Scene { name: name.to_owned(), ..scene }),
        Ok(scene) => Ok(scene),
        Err(fault) => Err(SceneError { file: name.to_owned(), fault }),
    }
}

fn read(bytes: &[u8], folder: Option<&Path>, options: &LoadOptions, budget: &Budget) -> Result<Scene, Fault> {
    let notes = Notes::default();
    let mut scene = {
        let container = container::split(bytes, &notes)?;
        let json = container::parse(container.json, budget, &notes)?;
        let root = Object::root(&json)?;
        container::check_version(&root, &notes)?;
        container::check_extensions(&root, &notes)?;
        let document = Document::new(root, container.binary, folder, budget, &notes)?;
        assemble::scene(&document, options.scene.as_ref())?
    };
    scene.notes = notes.into_vec();
    Ok(scene)
}
