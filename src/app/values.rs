//! Values of the command line that are more than a number or a path, each with its parser and its own complaints.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

use glam::{UVec2, Vec3};
use serde_json::Value;

use crate::files;
use crate::methods::settings::suggest;
use crate::methods::{self, METHODS, Method};
use crate::report::image::{MAX_PIXELS, MAX_SIDE};
use crate::scene::builtin;

/// Where a scene comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SceneSource {
    /// A .gltf or .glb file.
    File(PathBuf),
    /// The name after `builtin:`, known to exist.
    Builtin(String),
}

impl SceneSource {
    /// Of all files the scene is made of, or of its name. What cannot be read is the loader's to complain about.
    pub fn hash(&self) -> blake3::Hash {
        let mut hasher = blake3::Hasher::new();
        match self {
            Self::Builtin(name) => {
                hasher.update(name.as_bytes());
                hasher.update(env!("CARGO_PKG_VERSION").as_bytes());
            }
            Self::File(path) => {
                for file in scene_files(path) {
                    hasher.update(&files::read(&file).unwrap_or_default());
                }
            }
        }
        hasher.finalize()
    }
}

/// The file and, for JSON, the files beside it that it names.
fn scene_files(path: &Path) -> Vec<PathBuf> {
    let mut files = vec![path.to_owned()];
    let text = files::read(path).unwrap_or_default();
    let Ok(document) = serde_json::from_slice::<Value>(&text) else { return files };
    for list in ["buffers", "images"] {
        let uris = document[list].as_array().into_iter().flatten().filter_map(|entry| entry["uri"].as_str());
        for uri in uris.filter(|uri| !uri.starts_with("data:")) {
            let name = percent_encoding::percent_decode_str(uri).decode_utf8_lossy();
            files.push(path.with_file_name(name.as_ref()));
        }
    }
    files
}

impl fmt::Display for SceneSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(path) => path.display().fmt(f),
            Self::Builtin(name) => write!(f, "{}{name}", builtin::PREFIX),
        }
    }
}

impl FromStr for SceneSource {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Some(name) = text.strip_prefix(builtin::PREFIX) {
            builtin::resolve(name).map_err(|error| error.to_string())?;
            return Ok(Self::Builtin(name.to_owned()));
        }
        match extension(Path::new(text)).as_str() {
            "gltf" | "glb" => Ok(Self::File(text.into())),
            _ => Err("a scene is a .gltf or .glb file, or builtin:NAME".to_owned()),
        }
    }
}

/// A picture file to write.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Output {
    pub path: PathBuf,
    pub format: Format,
}

/// What a picture file holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Linear radiance.
    Exr,
    /// Tone-mapped sRGB.
    Png,
}

impl FromStr for Output {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let format = match extension(Path::new(text)).as_str() {
            "exr" => Format::Exr,
            "png" => Format::Png,
            _ => return Err("the name must end in .exr or .png".to_owned()),
        };
        Ok(Self { path: text.into(), format })
    }
}

/// A camera of the scene. A number is an index unless a camera has that name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CameraChoice {
    pub name: String,
    pub index: Option<usize>,
}

impl FromStr for CameraChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.is_empty() {
            return Err("a name or an index was expected".to_owned());
        }
        Ok(Self { name: text.to_owned(), index: text.parse().ok() })
    }
}

/// `--method`.
pub fn parse_method(text: &str) -> Result<&'static Method, String> {
    methods::find(text).ok_or_else(|| {
        let keys: Vec<&str> = METHODS.iter().map(|method| method.key).collect();
        format!("there is no such method; {}", suggest(text, &keys))
    })
}

/// `--method` of one picture: a method, or [`methods::AUTO`].
pub fn parse_method_or_auto(text: &str) -> Result<&'static Method, String> {
    if text == methods::AUTO.key { Ok(&methods::AUTO) } else { parse_method(text) }
}

/// `--size`.
pub fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let form = || "expected WIDTHxHEIGHT in pixels, such as 960x540".to_owned();
    let (width, height) = text.split_once(['x', 'X']).ok_or_else(form)?;
    let side = |text: &str| {
        if text.is_empty() || !text.bytes().all(|byte| byte.is_ascii_digit()) {
            return Err(form());
        }
        match text.parse::<u32>() {
            Ok(side) if (1..=MAX_SIDE).contains(&side) => Ok(side),
            _ => Err(format!("a side is 1 to {MAX_SIDE} pixels")),
        }
    };
    let (width, height) = (side(width)?, side(height)?);
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        return Err(format!(
            "{width}x{height} is {} pixels; at most {MAX_PIXELS}",
            u64::from(width) * u64::from(height)
        ));
    }
    Ok((width, height))
}

/// `--exposure`.
pub fn parse_exposure(text: &str) -> Result<f32, String> {
    number_within(text, -32.0, 32.0, "stops")
}

/// `--eye`, `--look-at`.
pub fn parse_place(text: &str) -> Result<Vec3, String> {
    let numbers: Option<Vec<f32>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x, y, z]) if [x, y, z].iter().all(|number| number.abs() <= 1e9) => Ok(Vec3::new(x, y, z)),
        _ => Err("expected X,Y,Z in metres, each within a thousand million".to_owned()),
    }
}

/// `--max-memory`: bytes, or so many K, M, G or T of 1024.
pub fn parse_memory(text: &str) -> Result<u64, String> {
    let form = || "expected bytes, or a whole number with K, M, G or T, such as 512M; at least 1M".to_owned();
    let (number, shift) = match text.char_indices().next_back() {
        Some((at, unit)) if unit.is_ascii_alphabetic() => {
            let place = "KMGT".find(unit.to_ascii_uppercase()).ok_or_else(form)?;
            (&text[..at], 10 * (place as u32 + 1))
        }
        _ => (text, 0),
    };
    let number: u64 = number.parse().map_err(|_| form())?;
    number.checked_mul(1 << shift).filter(|bytes| *bytes >= 1 << 20).ok_or_else(form)
}

/// `--fov`.
pub fn parse_field_of_view(text: &str) -> Result<f32, String> {
    number_within(text, 1.0, 170.0, "degrees")
}

/// `--env-turn`.
pub fn parse_turn(text: &str) -> Result<f32, String> {
    number_within(text, -360.0, 360.0, "degrees")
}

/// `--seconds` of `bench`.
pub fn parse_measuring_seconds(text: &str) -> Result<f64, String> {
    number_within(text, 0.0, 1e6, "seconds").map(f64::from)
}

/// A number above 0, at most 1.
pub fn parse_fraction(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number > 0.0 && number <= 1.0 => Ok(number),
        _ => Err("expected a number above 0, at most 1".to_owned()),
    }
}

/// A switch that is on by default.
pub fn parse_switch(text: &str) -> Result<bool, String> {
    match text {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err("expected on or off".to_owned()),
    }
}

/// `--explain`.
pub fn parse_pixel(text: &str) -> Result<UVec2, String> {
    let pixel =
        text.split_once(',').and_then(|(x, y)| Some(UVec2::new(x.trim().parse().ok()?, y.trim().parse().ok()?)));
    pixel.ok_or_else(|| "expected a pixel as X,Y, such as 480,270".to_owned())
}

/// `--gpu-timeout`: seconds, at most a day.
pub fn parse_timeout(text: &str) -> Result<Duration, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds > 0.0 && seconds <= 86_400.0 => Ok(Duration::from_secs_f64(seconds)),
        _ => Err("expected seconds above 0, at most 86400".to_owned()),
    }
}

/// `--seconds`.
pub fn parse_animation_seconds(text: &str) -> Result<f32, String> {
    number_within(text, 0.0, 1e6, "seconds")
}

/// `--scale`.
pub fn parse_scale(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(number) if (1e-6..=1e9).contains(&number) => Ok(number),
        _ => Err("expected a radiance from 1e-6 to 1e9 W/m2/sr".to_owned()),
    }
}

/// `--walls`.
pub fn parse_wall(text: &str) -> Result<u32, String> {
    match text.parse() {
        Ok(wall) if wall <= builtin::MAX_WALL => Ok(wall),
        _ => Err(format!("a wall is 0 to {} millimetres thick", builtin::MAX_WALL)),
    }
}

/// A scene to write.
pub fn parse_glb(text: &str) -> Result<PathBuf, String> {
    match extension(Path::new(text)).as_str() {
        "glb" => Ok(text.into()),
        _ => Err("the name must end in .glb".to_owned()),
    }
}

fn number_within(text: &str, min: f32, max: f32, unit: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(number) if (min..=max).contains(&number) => Ok(number),
        _ => Err(format!("expected a number from {min} to {max} {unit}")),
    }
}

/// The extension in lower case, empty where there is none.
pub fn extension(path: &Path) -> String {
    path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes() {
        assert_eq!(parse_size("960x540"), Ok((960, 540)));
        assert_eq!(parse_size("1X16384"), Ok((1, 16384)));
        for bad in
            ["", "x", "960", "960x", "x540", "0x5", "5x0", "16385x1", "-3x4", "+3x4", "3.0x4", "9x9x9", "99999999999x1"]
        {
            assert!(parse_size(bad).is_err(), "{bad:?}");
        }
        assert!(parse_size("16384x16384").unwrap_err().contains("at most"));
    }

    #[test]
    fn memory_sizes() {
        let sizes = ["1048576", "512M", "12g", "2048K", "1T"].map(|text| parse_memory(text).unwrap());
        assert_eq!(sizes, [1 << 20, 512 << 20, 12 << 30, 2 << 20, 1 << 40]);
        for bad in ["", "M", "-1M", "1.5G", "12P", "1023K", "0", "99999999999G", "1GB", "\u{e9}"] {
            assert!(parse_memory(bad).is_err(), "{bad:?}");
        }
    }

    #[test]
    fn scenes_outputs_and_cameras() {
        assert_eq!("a/b.GLB".parse(), Ok(SceneSource::File("a/b.GLB".into())));
        assert_eq!("builtin:cornell-box".parse(), Ok(SceneSource::Builtin("cornell-box".into())));
        for bad in ["", "a", "a.obj", "builtin:", "builtin", "builtin:cornel-box"] {
            assert!(bad.parse::<SceneSource>().is_err(), "{bad:?}");
        }
        assert_eq!("x.PNG".parse::<Output>().unwrap().format, Format::Png);
        assert!("x.jpg".parse::<Output>().is_err() && "exr".parse::<Output>().is_err());
        assert_eq!("3".parse::<CameraChoice>().unwrap().index, Some(3));
        assert_eq!("door".parse::<CameraChoice>().unwrap().index, None);
        assert!("".parse::<CameraChoice>().is_err());
    }

    #[test]
    fn numbers_and_methods() {
        assert_eq!(parse_exposure("-1.5"), Ok(-1.5));
        for bad in ["", "nan", "inf", "33", "bright"] {
            assert!(parse_exposure(bad).is_err(), "{bad:?}");
        }
        assert!(parse_animation_seconds("-0.1").is_err());
        assert_eq!(parse_method("path-tracing").unwrap().key, "path-tracing");
        assert!(parse_method("pathtracing").unwrap_err().contains("did you mean path-tracing?"));
    }
}
