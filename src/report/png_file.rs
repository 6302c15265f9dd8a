//! PNG: what a display shows, eight bits a channel, with text chunks.

use std::io::BufReader;
use std::path::Path;

use super::image::{MAX_PIXELS, Metadata, Picture, PictureError, check_length, check_size, decode, display_picture};
use super::write::write_whole;
use crate::files::File;

/// Write tone-mapped sRGB bytes (`width * height * 3`, row 0 at the top) with `metadata` as text chunks.
pub fn write_png(path: &Path, width: u32, height: u32, bytes: &[u8], metadata: &Metadata) -> Result<(), PictureError> {
    check_size(path, width.into(), height.into(), MAX_PIXELS)?;
    check_length("bytes", bytes.len(), width as usize * height as usize * 3)?;
    let fail = |error: png::EncodingError| PictureError::Encode {
        path: path.to_owned(),
        format: "PNG",
        reason: error.to_string(),
    };
    write_whole(path, |file| {
        let mut encoder = png::Encoder::new(file, width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        for (keyword, text) in metadata {
            // tEXt is Latin-1 only; anything beyond ASCII goes into the UTF-8 chunk.
            if text.is_ascii() {
                encoder.add_text_chunk(keyword.clone(), text.clone()).map_err(fail)?;
            } else {
                encoder.add_itxt_chunk(keyword.clone(), text.clone()).map_err(fail)?;
            }
        }
        let mut writer = encoder.write_header().map_err(fail)?;
        writer.write_image_data(bytes).map_err(fail)?;
        writer.finish().map_err(fail)
    })
}

/// Read a PNG of any colour type; alpha is dropped, 16-bit samples keep their precision.
pub(super) fn read(path: &Path, max_pixels: u64) -> Result<Picture, PictureError> {
    let decoded = decode(path, "PNG", ::image::ImageFormat::Png, max_pixels)?;
    let (width, height) = (decoded.width(), decoded.height());
    let sixteen_bit = decoded.color().bytes_per_pixel() / decoded.color().channel_count() == 2;
    let mut picture = if sixteen_bit {
        let pixels = decoded.into_rgb16();
        display_picture(width, height, pixels.pixels().map(|pixel| pixel.0.map(|sample| f32::from(sample) / 65535.0)))
    } else {
        let pixels = decoded.into_rgb8();
        display_picture(width, height, pixels.pixels().map(|pixel| pixel.0.map(|sample| f32::from(sample) / 255.0)))
    };
    picture.metadata = read_metadata(path);
    Ok(picture)
}

/// Text chunks before the pixels. The pixels were read already, so a file without readable text just has none.
fn read_metadata(path: &Path) -> Metadata {
    let Ok(file) = File::open(path) else { return Metadata::new() };
    let Ok(reader) = png::Decoder::new(BufReader::new(file)).read_info() else { return Metadata::new() };
    let info = reader.info();
    let latin = info.uncompressed_latin1_text.iter().map(|chunk| (chunk.keyword.clone(), chunk.text.clone()));
    let utf8 = info.utf8_text.iter().filter_map(|chunk| {
        // Decompressed within the decoder's limit: `get_text` alone has none, and a kilobyte can become a gigabyte.
        let mut chunk = chunk.clone();
        chunk.decompress_text().ok()?;
        Some((chunk.keyword.clone(), chunk.get_text().ok()?))
    });
    latin.chain(utf8).collect()
}
