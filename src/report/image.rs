//! Pictures in memory and on disk.
//!
//! A [`Picture`] is linear RGB with optional named channels (`direct.R`, `normal.X`, `depth.Z` ...). EXR and HDR
//! files hold radiance in scene units; PNG files hold what a display shows (sRGB, tone-mapped). Files are recognised
//! by their content, not their name, and every write is whole or not at all (see [`super::write`]).
//!
//! It does not tone-map: [`super::tonemap`] makes the bytes that [`write_png`] stores.

use std::collections::BTreeMap;
use std::io::{BufReader, Read as _};
use std::path::{Path, PathBuf};

use glam::Vec3;

pub use super::png_file::write_png;
use super::tonemap::srgb_decode;
use super::write::FileError;
use super::{exr_file, png_file};
use crate::files::File;

/// Longest side of a picture, pixels.
pub const MAX_SIDE: u32 = 16_384;
/// Most pixels of a picture: 768 MiB as RGB f32.
pub const MAX_PIXELS: u64 = 1 << 26;

/// Facts stored in a picture file beside its pixels, by key.
pub type Metadata = BTreeMap<String, String>;

/// Linear Rec. 709 RGB, row 0 at the top.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Picture {
    pub width: u32,
    pub height: u32,
    /// `width * height` pixels. [`Encoding`] says what they mean.
    pub rgb: Vec<Vec3>,
    pub encoding: Encoding,
    pub channels: Vec<Channel>,
    pub metadata: Metadata,
}

/// What the numbers of a picture are.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Encoding {
    /// Radiance in scene units, before exposure (EXR, HDR).
    #[default]
    Radiance,
    /// Display-linear values in 0..=1, already tone-mapped (a decoded PNG).
    Display,
}

/// One extra plane of numbers, `width * height` values.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// `layer.component`, as EXR viewers group them: `direct.R`, `normal.X`, `depth.Z`.
    pub name: String,
    pub values: Vec<f32>,
}

/// A picture that could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    #[error(transparent)]
    File(#[from] FileError),
    #[error("{} is not a picture: expected PNG, EXR or Radiance HDR data", .0.display())]
    UnknownFormat(PathBuf),
    #[error("{} ({format}) is damaged or not supported: {reason}", .path.display())]
    Decode { path: PathBuf, format: &'static str, reason: String },
    #[error("cannot write {} as {format}: {reason}", .path.display())]
    Encode { path: PathBuf, format: &'static str, reason: String },
    #[error(
        "{} is {width}x{height} pixels; at most {MAX_SIDE} a side and {MAX_PIXELS} in all are supported",
        .path.display()
    )]
    TooLarge { path: PathBuf, width: u64, height: u64 },
    #[error("{name} has {found} values where {expected} (width x height) were expected")]
    Shape { name: String, found: usize, expected: usize },
}

impl Picture {
    /// A radiance picture without extra channels. `rgb` must hold `width * height` pixels.
    pub fn new(width: u32, height: u32, rgb: Vec<Vec3>) -> Result<Self, PictureError> {
        let picture = Self { width, height, rgb, ..Self::default() };
        check_length("rgb", picture.rgb.len(), picture.pixel_count())?;
        Ok(picture)
    }

    /// `width * height`.
    pub fn pixel_count(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Add colour channels `layer.R`, `.G`, `.B`.
    pub fn add_rgb(&mut self, layer: &str, values: &[Vec3]) -> Result<(), PictureError> {
        self.add_components(layer, ["R", "G", "B"], values)
    }

    /// Add vector channels `layer.X`, `.Y`, `.Z`.
    pub fn add_xyz(&mut self, layer: &str, values: &[Vec3]) -> Result<(), PictureError> {
        self.add_components(layer, ["X", "Y", "Z"], values)
    }

    /// Add one channel under its full name, such as `depth.Z`.
    pub fn add_channel(&mut self, name: &str, values: Vec<f32>) -> Result<(), PictureError> {
        check_length(name, values.len(), self.pixel_count())?;
        self.channels.push(Channel { name: name.to_owned(), values });
        Ok(())
    }

    fn add_components(&mut self, layer: &str, names: [&str; 3], values: &[Vec3]) -> Result<(), PictureError> {
        for (component, name) in names.into_iter().enumerate() {
            self.add_channel(&format!("{layer}.{name}"), values.iter().map(|value| value[component]).collect())?;
        }
        Ok(())
    }

    /// The three channels of a layer as vectors: `.R .G .B`, else `.X .Y .Z`.
    pub fn layer(&self, layer: &str) -> Option<Vec<Vec3>> {
        let channel = |component: &str| {
            let name = format!("{layer}.{component}");
            self.channels.iter().find(|channel| channel.name == name).map(|channel| &channel.values)
        };
        [["R", "G", "B"], ["X", "Y", "Z"]].into_iter().find_map(|[x, y, z]| {
            let (x, y, z) = (channel(x)?, channel(y)?, channel(z)?);
            Some(x.iter().zip(y).zip(z).map(|((&x, &y), &z)| Vec3::new(x, y, z)).collect())
        })
    }

    /// Names before the dot of every extra channel, each once, in file order.
    pub fn layer_names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for channel in &self.channels {
            let name = channel.name.rsplit_once('.').map_or(channel.name.as_str(), |(layer, _)| layer);
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }
}

/// Write RGB f32 and every channel as a losslessly compressed EXR. The same picture gives the same bytes.
pub fn write_exr(path: &Path, picture: &Picture) -> Result<(), PictureError> {
    check_length("rgb", picture.rgb.len(), picture.pixel_count())?;
    check_size(path, picture.width.into(), picture.height.into(), MAX_PIXELS)?;
    exr_file::write(path, picture)
}

/// Read a PNG, EXR or HDR file, whichever its content says it is.
pub fn read(path: &Path) -> Result<Picture, PictureError> {
    read_within(path, MAX_PIXELS)
}

/// As [`read`], of at most `max_pixels` pixels.
pub fn read_within(path: &Path, max_pixels: u64) -> Result<Picture, PictureError> {
    let mut start = [0; 8];
    let mut file = File::open(path).map_err(|source| FileError::new("open", path, source))?;
    let metadata = file.metadata().map_err(|source| FileError::new("read", path, source))?;
    if metadata.is_dir() {
        let source = std::io::Error::new(std::io::ErrorKind::IsADirectory, "it is a folder");
        return Err(FileError::new("read", path, source).into());
    }
    let length = read_up_to(&mut file, &mut start).map_err(|source| FileError::new("read", path, source))?;
    match &start[..length] {
        b"\x89PNG\r\n\x1a\n" => png_file::read(path, max_pixels),
        [0x76, 0x2f, 0x31, 0x01, ..] => exr_file::read(path, max_pixels),
        [b'#', b'?', ..] => read_hdr(path, max_pixels),
        _ => Err(PictureError::UnknownFormat(path.to_owned())),
    }
}

fn read_up_to(file: &mut File, buffer: &mut [u8]) -> std::io::Result<usize> {
    let mut length = 0;
    while length < buffer.len() {
        match file.read(&mut buffer[length..])? {
            0 => break,
            count => length += count,
        }
    }
    Ok(length)
}

fn read_hdr(path: &Path, max_pixels: u64) -> Result<Picture, PictureError> {
    let decoded = decode(path, "HDR", ::image::ImageFormat::Hdr, max_pixels)?.into_rgb32f();
    let (width, height) = decoded.dimensions();
    let rgb = decoded.pixels().map(|pixel| Vec3::from_array(pixel.0)).collect();
    Picture::new(width, height, rgb)
}

/// Decode by the `image` crate, with the size checked before anything is allocated for it.
pub(super) fn decode(
    path: &Path,
    format: &'static str,
    kind: ::image::ImageFormat,
    max_pixels: u64,
) -> Result<::image::DynamicImage, PictureError> {
    use ::image::ImageDecoder as _;
    let broken =
        |error: ::image::ImageError| PictureError::Decode { path: path.to_owned(), format, reason: error.to_string() };
    let file = File::open(path).map_err(|source| FileError::new("open", path, source))?;
    let reader = ::image::ImageReader::with_format(BufReader::new(file), kind);
    let decoder = reader.into_decoder().map_err(broken)?;
    let (width, height) = decoder.dimensions();
    check_size(path, width.into(), height.into(), max_pixels)?;
    ::image::DynamicImage::from_decoder(decoder).map_err(broken)
}

/// Linear values of encoded sRGB samples in 0..=1.
pub(super) fn display_picture(width: u32, height: u32, samples: impl Iterator<Item = [f32; 3]>) -> Picture {
    let rgb = samples.map(|sample| Vec3::from_array(sample.map(srgb_decode))).collect();
    Picture { width, height, rgb, encoding: Encoding::Display, ..Picture::default() }
}

pub(super) fn check_size(path: &Path, width: u64, height: u64, max_pixels: u64) -> Result<(), PictureError> {
    let side = u64::from(MAX_SIDE);
    if width == 0 || height == 0 || width > side || height > side || width * height > max_pixels {
        return Err(PictureError::TooLarge { path: path.to_owned(), width, height });
    }
    Ok(())
}

pub(super) fn check_length(name: &str, found: usize, expected: usize) -> Result<(), PictureError> {
    if found == expected { Ok(()) } else { Err(PictureError::Shape { name: name.to_owned(), found, expected }) }
}

#[cfg(test)]
#[path = "image_tests.rs"]
mod tests;
