//! The scenes that come with the program, by name: `builtin:NAME` on the command line.
//!
//! Most are .glb files in `assets/`, made by `tools/make_scenes` and kept inside the binary. The gallery is made when it
//! is loaded, with as many triangles as asked: `builtin:gallery?triangles=1500000`; so are the closed rooms, with a wall as
//! thick as asked: `builtin:closed-rooms?wall=20&sides=two`.

mod closed_rooms;
mod gallery;
mod statues;

use super::{LoadOptions, Scene, SceneError, load, load_bytes_with};
use std::path::Path;
use thiserror::Error;

pub use closed_rooms::{ClosedRooms, MAX_WALL};

/// What a scene argument must start with to name a built-in scene.
pub const PREFIX: &str = "builtin:";

/// A scene that comes with the program.
#[derive(Debug, Clone, Copy)]
pub struct Builtin {
    pub name: &'static str,
    /// One line for listings.
    pub description: &'static str,
    source: Source,
}

/// What stands behind a built-in name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// The bytes of a .glb file.
    File(&'static [u8]),
    /// Made on the spot, with about so many triangles.
    Gallery { triangles: u32 },
    /// Made on the spot.
    ClosedRooms(ClosedRooms),
}

#[derive(Debug, Error, PartialEq, Eq)]
pub enum BuiltinError {
    #[error("there is no built-in scene '{name}'; choose one of: {}", names())]
    UnknownName { name: String },
    #[error("built-in scene '{name}' takes no parameters, but '{parameters}' was given; write builtin:{name}")]
    NoParameters { name: String, parameters: String },
    #[error(
        "built-in scene 'gallery' does not understand '{parameters}'; it takes triangles=N with N from {} to {}, as in \
         builtin:gallery?triangles={}",
        gallery::TRIANGLES.start(),
        gallery::TRIANGLES.end(),
        gallery::DEFAULT_TRIANGLES
    )]
    GalleryParameters { parameters: String },
    #[error(
        "built-in scene 'closed-rooms' does not understand '{parameters}'; it takes wall=MM with MM from 0 to {MAX_WALL} \
         and sides=one or sides=two, as in builtin:closed-rooms?wall=20&sides=two"
    )]
    ClosedRoomsParameters { parameters: String },
    #[error(
        "built-in scene 'gallery' with {triangles} triangles needs {needed} bytes to be made, more than the {allowed} \
         allowed; ask for fewer triangles or raise --max-memory"
    )]
    GalleryMemory { triangles: u32, needed: u64, allowed: u64 },
}

/// Why [`open`] failed.
#[derive(Debug, Error)]
pub enum OpenError {
    #[error(transparent)]
    Builtin(#[from] BuiltinError),
    #[error(transparent)]
    File(#[from] SceneError),
}

macro_rules! file {
    ($name:literal, $description:literal) => {
        Builtin {
            name: $name,
            description: $description,
            source: Source::File(include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/assets/", $name, ".glb"))),
        }
    };
}

/// All built-in scenes, simplest first.
pub static BUILTINS: [Builtin; 13] = [
    file!("cornell-box", "the Cornell box as measured: two boxes under an area light"),
    file!("cornell-empty", "the Cornell box without its boxes"),
    file!("furnace", "closed room, albedo 0.5 and radiance 1 everywhere: after k bounces 2 - 2^-k"),
    file!("parallel-plates", "unit squares face to face at distance 1: form factor 0.199825"),
    file!("perpendicular-plates", "unit squares sharing an edge: form factor 0.200044"),
    file!("two-rooms", "a lit and a dark room with a closed door between them"),
    Builtin {
        name: "closed-rooms",
        description: "a lit and a dark room, nothing between them but a wall; closed-rooms?wall=MM&sides=one|two",
        source: Source::ClosedRooms(ClosedRooms { wall: 50, two_sided: false }),
    },
    file!("maze", "partitions lit only indirectly: the sun meets a wall the viewer cannot see"),
    file!("office", "sun and sky through a window, desk, shelves of books, chairs; textures"),
    file!("tea-room", "silver, copper and glazed pots on a table, arched windows, a lamp; glossy and metallic"),
    file!("church", "a basilica: arches on columns, stained glass, sun through the clerestory, candles"),
    file!("dancer", "a skinned dancer and a morphing blob on a stage, four seconds in a loop"),
    Builtin {
        name: "gallery",
        description: "eight statues under a skylight; gallery?triangles=N sets their detail",
        source: Source::Gallery { triangles: gallery::DEFAULT_TRIANGLES },
    },
];

/// Finds a scene by `NAME` or `NAME?PARAMETERS` (without the prefix).
pub fn resolve(name: &str) -> Result<Source, BuiltinError> {
    let (stem, parameters) = name.split_once('?').unwrap_or((name, ""));
    let found = BUILTINS.iter().find(|b| b.name == stem);
    let builtin = found.ok_or_else(|| BuiltinError::UnknownName { name: stem.into() })?;
    match builtin.source {
        Source::File(_) if !parameters.is_empty() => {
            Err(BuiltinError::NoParameters { name: stem.into(), parameters: parameters.into() })
        }
        Source::Gallery { .. } if !parameters.is_empty() => {
            let asked = parameters.strip_prefix("triangles=").and_then(|n| n.parse().ok());
            match asked.filter(|n| gallery::TRIANGLES.contains(n)) {
                Some(triangles) => Ok(Source::Gallery { triangles }),
                None => Err(BuiltinError::GalleryParameters { parameters: parameters.into() }),
            }
        }
        Source::ClosedRooms(_) => match ClosedRooms::parse(parameters) {
            Some(rooms) => Ok(Source::ClosedRooms(rooms)),
            None => Err(BuiltinError::ClosedRoomsParameters { parameters: parameters.into() }),
        },
        source => Ok(source),
    }
}

/// Loads a scene by the name of a built-in one after [`PREFIX`], or by the path of a `.gltf` or `.glb` file.
///
/// # Errors
/// Unknown names and parameters, and whatever [`load`] refuses.
pub fn open(scene: &str, options: &LoadOptions) -> Result<Scene, OpenError> {
    match scene.strip_prefix(PREFIX) {
        Some(name) => match resolve(name)? {
            Source::File(bytes) => Ok(load_bytes_with(scene, bytes, options)?),
            Source::ClosedRooms(rooms) => Ok(rooms.scene()),
            Source::Gallery { triangles } => {
                let (needed, allowed) = (u64::from(triangles) * gallery::BYTES_PER_TRIANGLE, options.max_memory_bytes);
                if needed > allowed {
                    return Err(BuiltinError::GalleryMemory { triangles, needed, allowed }.into());
                }
                Ok(gallery::gallery(triangles))
            }
        },
        None => Ok(load(Path::new(scene), options)?),
    }
}

fn names() -> String {
    BUILTINS.map(|b| b.name).join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_resolves() {
        for builtin in &BUILTINS {
            assert_eq!(resolve(builtin.name), Ok(builtin.source));
            assert!(!builtin.description.contains('\n'), "{} has a description of one line", builtin.name);
        }
    }

    #[test]
    fn every_name_loads() {
        for builtin in &BUILTINS {
            let scene = open(&format!("{PREFIX}{}", builtin.name), &LoadOptions::default());
            let scene = scene.unwrap_or_else(|error| panic!("{}: {error}", builtin.name));
            assert_eq!(scene.name, builtin.name);
            assert_eq!(scene.notes, [""; 0], "{} loads without a note", builtin.name);
            assert_eq!(scene.cameras[0].name, "main", "{}", builtin.name);
        }
    }

    #[test]
    fn an_unknown_name_lists_the_choices() {
        let message = resolve("cornel-box").unwrap_err().to_string();
        assert!(message.contains("cornel-box") && message.contains("cornell-box"), "{message}");
    }

    #[test]
    fn the_gallery_takes_a_number_of_triangles() {
        assert_eq!(resolve("gallery?triangles=1500000"), Ok(Source::Gallery { triangles: 1_500_000 }));
        for bad in [
            "triangles",
            "triangles=",
            "triangles=3",
            "triangles=-1",
            "triangles=1e6",
            "statues=4",
            "triangles=99999999999",
        ] {
            let message = resolve(&format!("gallery?{bad}")).unwrap_err().to_string();
            assert!(message.contains(bad) && message.contains("triangles=N"), "{message}");
        }
    }

    #[test]
    fn the_gallery_keeps_to_the_memory_allowed() {
        let options = LoadOptions { max_memory_bytes: 1 << 20, ..LoadOptions::default() };
        let message = open("builtin:gallery", &options).unwrap_err().to_string();
        assert!(message.contains("100000 triangles") && message.contains("1048576"), "{message}");
    }

    #[test]
    fn parameters_are_refused_where_there_are_none() {
        let message = resolve("furnace?size=3").unwrap_err().to_string();
        assert!(message.contains("size=3"), "{message}");
    }
}
