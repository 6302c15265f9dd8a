//! Reads `.hdr` (Radiance) and `.exr` files as environments: sizes are checked from the header before anything is
//! decoded, and texels that are no radiance are repaired and counted.

use std::io::{self, Cursor, Read};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use exr::prelude::{ReadChannels, ReadLayers};
use glam::Vec3;
use image::ImageDecoder;
use image::codecs::hdr::HdrDecoder;
use thiserror::Error;

use super::{Environment, EnvironmentMap};
use crate::files::{File, decode};

/// What a map may cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EnvironmentLimits {
    /// Texels a side.
    pub max_extent: u32,
    /// For the file, its decoded texels and what decoding needs beside them.
    pub max_memory_bytes: u64,
}

impl Default for EnvironmentLimits {
    fn default() -> Self {
        Self { max_extent: 16384, max_memory_bytes: 4 << 30 }
    }
}

/// Radiance above this (W m^-2 sr^-1) is cut: sums over a map and products with it must stay finite.
pub const MAX_RADIANCE: f32 = 1e9;

#[derive(Debug, Error)]
pub enum EnvironmentError {
    #[error("environment {}: {source}", path.display())]
    Read { path: PathBuf, source: io::Error },
    #[error("environment {}: neither a Radiance .hdr nor an OpenEXR file; convert it to one of these", path.display())]
    UnknownFormat { path: PathBuf },
    #[error("environment {}: {message}", path.display())]
    Decode { path: PathBuf, message: String },
    #[error(
        "environment {}: {width} x {height} texels, allowed is 1 to {allowed} a side; resize the picture",
        path.display()
    )]
    Extent { path: PathBuf, width: u64, height: u64, allowed: u32 },
    #[error(
        "environment {}: {needed} bytes needed, {available} allowed; resize the picture or raise --max-memory",
        path.display()
    )]
    OutOfMemory { path: PathBuf, needed: u64, available: u64 },
    #[error(
        "environment {text:?}: {problem}; write three numbers R,G,B of 0 to {MAX_RADIANCE:e}, or a .hdr or .exr file"
    )]
    Constant { text: String, problem: &'static str },
}

/// What `--env` names: `R,G,B`, else a file.
#[derive(Debug, Clone, PartialEq)]
pub enum EnvironmentSource {
    Constant(Vec3),
    File(PathBuf),
}

impl FromStr for EnvironmentSource {
    type Err = EnvironmentError;

    fn from_str(text: &str) -> Result<Self, EnvironmentError> {
        let fail = |problem| Err(EnvironmentError::Constant { text: text.into(), problem });
        let numbers: Result<Vec<f32>, _> = text.split(',').map(|number| number.trim().parse()).collect();
        let Ok(numbers) = numbers else {
            return if text.trim().is_empty() { fail("it is empty") } else { Ok(Self::File(text.into())) };
        };
        let [r, g, b] = numbers[..] else { return fail("not three numbers") };
        if ![r, g, b].iter().all(|value| (0.0..=MAX_RADIANCE).contains(value)) {
            return fail("a number is negative, too large or not finite");
        }
        Ok(Self::Constant(Vec3::new(r, g, b)))
    }
}

/// A loaded environment and what was repaired in it, in whole sentences.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadedEnvironment {
    pub environment: Environment,
    pub notes: Vec<String>,
}

/// Loads what `source` names; a map is turned by `rotation` radians about +Y.
pub fn load(
    source: &EnvironmentSource,
    rotation: f32,
    limits: &EnvironmentLimits,
) -> Result<LoadedEnvironment, EnvironmentError> {
    let path = match source {
        EnvironmentSource::Constant(radiance) => {
            return Ok(LoadedEnvironment { environment: Environment::Constant(*radiance), notes: Vec::new() });
        }
        EnvironmentSource::File(path) => path,
    };
    load_bytes(path, &read_file(path, limits)?, rotation, limits)
}

/// As [`load`], of a file's content; `path` names it in messages.
pub fn load_bytes(
    path: &Path,
    bytes: &[u8],
    rotation: f32,
    limits: &EnvironmentLimits,
) -> Result<LoadedEnvironment, EnvironmentError> {
    let mut notes = Vec::new();
    let (width, height, mut texels) = if bytes.starts_with(b"#?") {
        decode_hdr(path, bytes, limits, &mut notes)?
    } else if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        decode_exr(path, bytes, limits)?
    } else {
        return Err(EnvironmentError::UnknownFormat { path: path.into() });
    };
    notes.extend(repair(path, &mut texels));
    let rotation = if rotation.is_finite() { rotation } else { 0.0 };
    let environment = Environment::Map(EnvironmentMap { width, height, texels, rotation });
    Ok(LoadedEnvironment { environment, notes })
}

fn read_file(path: &Path, limits: &EnvironmentLimits) -> Result<Vec<u8>, EnvironmentError> {
    let failed = |source| EnvironmentError::Read { path: path.into(), source };
    let file = File::open(path).map_err(failed)?;
    let available = limits.max_memory_bytes;
    let mut bytes = Vec::new();
    // One byte more than allowed tells a file that is too long, whatever its stated length (a pipe has none).
    file.take(available.saturating_add(1)).read_to_end(&mut bytes).map_err(failed)?;
    let needed = bytes.len() as u64;
    if needed > available {
        return Err(EnvironmentError::OutOfMemory { path: path.into(), needed, available });
    }
    Ok(bytes)
}

/// Refuses a picture by its header's size, `bytes` being the file's own length.
fn check_size(
    path: &Path,
    [width, height]: [u64; 2],
    bytes: usize,
    limits: &EnvironmentLimits,
) -> Result<(), EnvironmentError> {
    let allowed = u64::from(limits.max_extent);
    if width == 0 || height == 0 || width > allowed || height > allowed {
        return Err(EnvironmentError::Extent { path: path.into(), width, height, allowed: limits.max_extent });
    }
    // The texels, as the decoder gives them and as we keep them, and the file.
    let needed = (width * height).saturating_mul(2 * size_of::<Vec3>() as u64).saturating_add(bytes as u64);
    if needed > limits.max_memory_bytes {
        let available = limits.max_memory_bytes;
        return Err(EnvironmentError::OutOfMemory { path: path.into(), needed, available });
    }
    Ok(())
}

type Decoded = (u32, u32, Vec<Vec3>);

fn decode_hdr(
    path: &Path,
    bytes: &[u8],
    limits: &EnvironmentLimits,
    notes: &mut Vec<String>,
) -> Result<Decoded, EnvironmentError> {
    let failed = |error: image::ImageError| EnvironmentError::Decode { path: path.into(), message: error.to_string() };
    let decoder = HdrDecoder::new_nonstrict(bytes).map_err(failed)?;
    let metadata = decoder.metadata();
    let (width, height) = decoder.dimensions();
    check_size(path, [width, height].map(u64::from), bytes.len(), limits)?;
    // A scanline takes at least one four-byte pixel: a tiny file that states a huge picture ends here.
    if (bytes.len() as u64) < u64::from(height) * 4 {
        let message = format!("{} bytes cannot hold {height} rows; the file is cut off", bytes.len());
        return Err(EnvironmentError::Decode { path: path.into(), message });
    }
    let mut texels = vec![Vec3::ZERO; width as usize * height as usize];
    decoder.read_image(bytemuck::cast_slice_mut(&mut texels)).map_err(failed)?;
    // The format's own rule: stored values are radiance times the stated exposure.
    match metadata.exposure {
        Some(exposure) if exposure.is_finite() && exposure > 0.0 && exposure != 1.0 => {
            texels.iter_mut().for_each(|texel| *texel /= exposure);
            notes.push(format!("Environment {}: divided by the file's exposure {exposure}.", path.display()));
        }
        _ => {}
    }
    Ok((width, height, texels))
}

fn decode_exr(path: &Path, bytes: &[u8], limits: &EnvironmentLimits) -> Result<Decoded, EnvironmentError> {
    let failed = |message: String| EnvironmentError::Decode { path: path.into(), message };
    let read = || exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|error| error.to_string());
    let metadata = decode(read).map_err(failed)?;
    for header in &metadata.headers {
        check_size(path, [header.layer_size.x(), header.layer_size.y()].map(|side| side as u64), bytes.len(), limits)?;
        // The decoder's tables grow with the stated tiles, however small the picture is.
        if let exr::meta::BlockDescription::Tiles(tiles) = header.blocks {
            let side = tiles.tile_size.x().max(tiles.tile_size.y());
            if side as u64 > u64::from(limits.max_extent) {
                return Err(failed(format!(
                    "its tiles are {side} pixels a side, at most {} are read",
                    limits.max_extent
                )));
            }
        }
    }
    let image = decode(|| {
        exr::image::read::read()
            .no_deep_data()
            .largest_resolution_level()
            .rgb_channels(
                |size, _| (size.x(), vec![Vec3::ZERO; size.x() * size.y()]),
                |(width, texels): &mut (usize, Vec<Vec3>), at, (r, g, b): (f32, f32, f32)| {
                    texels[at.y() * *width + at.x()] = Vec3::new(r, g, b);
                },
            )
            .first_valid_layer()
            .all_attributes()
            // On threads of its own a panic would end the process.
            .non_parallel()
            .from_buffered(Cursor::new(bytes))
            .map_err(|error| error.to_string())
    })
    .map_err(failed)?;
    let size = image.layer_data.size;
    Ok((size.x() as u32, size.y() as u32, image.layer_data.channel_data.pixels.1))
}

/// Makes every texel a radiance; says what it changed.
fn repair(path: &Path, texels: &mut [Vec3]) -> Option<String> {
    let mut repaired = 0u64;
    for texel in texels {
        let fixed = Vec3::from_array(
            texel.to_array().map(|value| if value.is_nan() { 0.0 } else { value.clamp(0.0, MAX_RADIANCE) }),
        );
        repaired += u64::from(fixed != *texel);
        *texel = fixed;
    }
    (repaired > 0).then(|| {
        format!(
            "Environment {}: {repaired} texels were negative, not a number or above {MAX_RADIANCE:e}; they count as 0 \
             or {MAX_RADIANCE:e}.",
            path.display()
        )
    })
}
