//! PNG and JPEG images to eight-bit RGBA: sizes are known and counted before anything is decoded.

use super::document::Document;
use super::error::{Fault, shown};
use super::json::Object;
use crate::scene::{Image, MAX_IMAGE_EXTENT};
use ::image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Cursor;

/// As notes call it.
const PART: &str = "A texture image";

/// An image whose header has been read and whose pixels have been counted.
struct Encoded<'d> {
    name: String,
    pointer: String,
    bytes: Cow<'d, [u8]>,
    format: ImageFormat,
    width: u32,
    height: u32,
    /// What decoding takes beside the result.
    working_bytes: u64,
}

/// Decodes the images of `wanted` (the file's index, whether sRGB), on all cores. An unreadable one is `None`, with a
/// note, as a picture without one texture is better than none; what breaks the budget or a rule of safety is an error.
pub fn decode(document: &Document, wanted: &[(usize, bool)]) -> Result<Vec<Option<Image>>, Fault> {
    let images = document.list("images")?;
    let mut uses: BTreeMap<usize, u64> = BTreeMap::new();
    for (index, _) in wanted {
        *uses.entry(*index).or_default() += 1;
    }
    let mut jobs = Vec::new();
    for (index, uses) in &uses {
        let encoded = document.tolerate(PART, open(document, &images.object(*index)?, *uses))?;
        jobs.extend(encoded.map(|encoded| (*index, encoded)));
    }

    // No more images are in work at a time than there are threads.
    let mut working: Vec<u64> = jobs.iter().map(|(_, encoded)| encoded.working_bytes).collect();
    working.sort_unstable_by(|a, b| b.cmp(a));
    let at_a_time =
        working.iter().take(rayon::current_num_threads()).fold(0, |sum: u64, bytes| sum.saturating_add(*bytes));
    document.budget.reserve(at_a_time, || "decoding the images".into())?;
    let decoded: Vec<_> = jobs.par_iter().map(|(index, encoded)| (*index, encoded.decode())).collect();
    document.budget.release(at_a_time);

    let mut by_index = BTreeMap::new();
    for (index, result) in decoded {
        by_index.extend(document.tolerate(PART, result)?.map(|image| (index, image)));
    }
    let mut take = |index: &usize, srgb: bool| {
        let left = uses.get_mut(index)?;
        *left -= 1;
        // The last use takes the pixels, earlier ones copy them.
        let image = if *left == 0 { by_index.remove(index) } else { by_index.get(index).cloned() };
        image.map(|image| Image { srgb, ..image })
    };
    Ok(wanted.iter().map(|(index, srgb)| take(index, *srgb)).collect())
}

/// Finds the image's bytes, reads its header, and counts what keeping it `uses` times will take.
fn open<'d>(document: &'d Document, image: &Object, uses: u64) -> Result<Encoded<'d>, Fault> {
    let pointer = image.pointer().to_owned();
    let bytes = match (image.text("uri")?, image.has("bufferView")) {
        (Some(uri), false) => Cow::Owned(document.read_uri(uri, &image.at("uri"))?),
        (None, true) => Cow::Borrowed(document.view(image, "bufferView")?.bytes),
        (uri, _) => {
            let seen = if uri.is_some() { "both" } else { "neither" };
            return Err(Fault::invalid(pointer, "must have either uri or bufferView", seen));
        }
    };
    // The first bytes decide: the stated MIME type is often wrong, and glTF allows it to be absent.
    let format = match ::image::guess_format(&bytes) {
        Ok(format @ (ImageFormat::Png | ImageFormat::Jpeg)) => format,
        _ => {
            let first = &bytes[..bytes.len().min(8)];
            return Err(Fault::invalid(
                pointer,
                "must be a PNG or a JPEG",
                format!("data that starts with {first:02x?}"),
            ));
        }
    };
    let (width, height, decoded_bytes) = {
        let decoder = decoder(&bytes, format, Limits::no_limits());
        let decoder = decoder.map_err(|error| unreadable(&pointer, &error))?;
        let (width, height) = decoder.dimensions();
        (width, height, decoder.total_bytes())
    };
    if width == 0 || height == 0 || width > MAX_IMAGE_EXTENT || height > MAX_IMAGE_EXTENT {
        let rule = format!("must be from 1 to {MAX_IMAGE_EXTENT} pixels a side");
        return Err(Fault::too_large(pointer, rule, format!("{width} x {height}")));
    }
    let pixels = u64::from(width) * u64::from(height);
    document.budget.reserve(pixels * 4 * uses, || format!("the {width} x {height} image {pointer}"))?;
    // A progressive JPEG holds the coefficients of all its scans, two bytes a sample, beside what it decodes to.
    let coefficient_bytes = if format == ImageFormat::Jpeg { pixels * 6 } else { 0 };
    let working_bytes = decoded_bytes.saturating_add(coefficient_bytes);
    let name = match image.name() {
        name if name.is_empty() => image.text("uri")?.filter(|uri| !uri.starts_with("data:")).unwrap_or("").into(),
        name => name,
    };
    Ok(Encoded { name, pointer, bytes, format, width, height, working_bytes })
}

impl Encoded<'_> {
    fn decode(&self) -> Result<Image, Fault> {
        let mut limits = Limits::no_limits();
        limits.max_image_width = Some(MAX_IMAGE_EXTENT);
        limits.max_image_height = Some(MAX_IMAGE_EXTENT);
        // Room for what the decoder keeps beside the pixels (palettes, profiles, rows): generous, yet not unbounded.
        limits.max_alloc = Some(self.working_bytes.saturating_mul(2).saturating_add(64 << 20));
        let decoder = decoder(&self.bytes, self.format, limits).map_err(|error| unreadable(&self.pointer, &error))?;
        let decoded = DynamicImage::from_decoder(decoder).map_err(|error| unreadable(&self.pointer, &error))?;
        let rgba = decoded.into_rgba8().into_raw();
        Ok(Image { name: self.name.clone(), width: self.width, height: self.height, rgba, srgb: false })
    }
}

fn decoder(bytes: &[u8], format: ImageFormat, limits: Limits) -> ::image::ImageResult<impl ImageDecoder> {
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    reader.limits(limits);
    reader.into_decoder()
}

fn unreadable(pointer: &str, error: &::image::ImageError) -> Fault {
    Fault::invalid(pointer, "must be a readable PNG or JPEG", shown(&error.to_string()))
}
