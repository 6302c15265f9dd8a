//! OpenEXR: linear radiance as RGB f32 plus named channels, in one part.
//!
//! Metadata is one text attribute, `linklight`, holding a JSON object: the file library stores attributes in a hash
//! map, and several of them would be written in a different order at every run.

use std::collections::BTreeMap;
use std::io::BufReader;
use std::path::Path;

use exr::image::Blocks;
use exr::meta::attribute::AttributeValue;
use exr::prelude::{
    AnyChannel, AnyChannels, Compression, Encoding, FlatSamples, Image, Layer, LayerAttributes, LineOrder, MetaData,
    ReadChannels as _, ReadLayers as _, Text, Vec2, WritableImage as _,
};
use glam::Vec3;

use super::image::{Channel, MAX_SIDE, Metadata, Picture, PictureError, check_length, check_size};
use super::write::{FileError, write_whole};
use crate::files::{File, decode};

const METADATA_ATTRIBUTE: &str = "linklight";
/// Most channels of the largest picture that is read; ours have up to 16.
const MAX_CHANNELS: u64 = 16;

pub(super) fn write(path: &Path, picture: &Picture) -> Result<(), PictureError> {
    let fail = |reason: String| PictureError::Encode { path: path.to_owned(), format: "EXR", reason };
    let text = |text: &str| {
        Text::new_or_none(text).ok_or_else(|| fail(format!("{text:?} holds characters that EXR text cannot")))
    };

    let mut planes: BTreeMap<&str, Vec<f32>> = BTreeMap::new();
    for (component, name) in ["R", "G", "B"].into_iter().enumerate() {
        planes.insert(name, picture.rgb.iter().map(|pixel| pixel[component]).collect());
    }
    for channel in &picture.channels {
        check_length(&channel.name, channel.values.len(), picture.pixel_count())?;
        if planes.insert(&channel.name, channel.values.clone()).is_some() {
            return Err(fail(format!("the channel {:?} is there twice", channel.name)));
        }
    }
    let mut list = Vec::with_capacity(planes.len());
    for (name, values) in planes {
        list.push(AnyChannel::new(text(name)?, FlatSamples::F32(values)));
    }

    let mut attributes = LayerAttributes { software_name: Some(Text::from("linklight")), ..Default::default() };
    if !picture.metadata.is_empty() {
        let json = ascii_json(&picture.metadata);
        attributes.other.insert(text(METADATA_ATTRIBUTE)?, AttributeValue::Text(text(&json)?));
    }
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let size = Vec2(picture.width as usize, picture.height as usize);
    let layer = Layer::new(size, attributes, encoding, AnyChannels::sort(list.into_iter().collect()));
    let image = Image::from_layer(layer);
    write_whole(path, |file| image.write().to_buffered(file).map_err(|error| fail(error.to_string())))
}

pub(super) fn read(path: &Path, max_pixels: u64) -> Result<Picture, PictureError> {
    let fail = |reason: String| PictureError::Decode { path: path.to_owned(), format: "EXR", reason };
    let open = || File::open(path).map_err(|source| FileError::new("open", path, source));

    // Sizes first: nothing is allocated for a file that only claims to be large.
    let file = BufReader::new(open()?);
    let headers =
        decode(|| MetaData::read_from_buffered(file, false).map_err(|error| error.to_string())).map_err(fail)?;
    let mut samples: u64 = 0;
    for header in &headers.headers {
        let [width, height] = [header.layer_size.width(), header.layer_size.height()].map(|side| side as u64);
        check_size(path, width, height, max_pixels)?;
        // The decoder's tables grow with the stated tiles, however small the picture is.
        if let exr::meta::BlockDescription::Tiles(tiles) = header.blocks {
            let side = tiles.tile_size.x().max(tiles.tile_size.y());
            if side > MAX_SIDE as usize {
                return Err(fail(format!("its tiles are {side} pixels a side, at most {MAX_SIDE} are read")));
            }
        }
        samples = samples.saturating_add((width * height).saturating_mul(header.channels.list.len() as u64));
    }
    // All parts are decoded at once, each channel for itself.
    let allowed = MAX_CHANNELS * max_pixels;
    if samples > allowed {
        return Err(fail(format!(
            "it states {samples} samples in all its channels and parts, at most {allowed} are read"
        )));
    }

    let file = BufReader::new(open()?);
    let image = decode(|| {
        exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .all_layers()
            .all_attributes()
            // On threads of its own a panic would end the process.
            .non_parallel()
            .from_buffered(file)
            .map_err(|error| error.to_string())
    })
    .map_err(fail)?;

    let has_rgb = |list: &[AnyChannel<FlatSamples>]| {
        ["R", "G", "B"].iter().all(|name| list.iter().any(|channel| channel.name == **name))
    };
    let Some(layer) = image.layer_data.into_iter().find(|layer| has_rgb(&layer.channel_data.list)) else {
        return Err(fail("no part holds the channels R, G and B".to_owned()));
    };

    let (width, height) = (layer.size.width(), layer.size.height());
    let mut picture = Picture { width: width as u32, height: height as u32, ..Picture::default() };
    picture.rgb = vec![Vec3::ZERO; width * height];
    for channel in layer.channel_data.list {
        let name = channel.name.to_string();
        let values: Vec<f32> = channel.sample_data.values_as_f32().collect();
        if values.len() != width * height {
            return Err(fail(format!("the channel {name:?} is subsampled; full resolution was expected")));
        }
        match ["R", "G", "B"].iter().position(|component| *component == name) {
            Some(component) => {
                for (pixel, value) in picture.rgb.iter_mut().zip(values) {
                    pixel[component] = value;
                }
            }
            None => picture.channels.push(Channel { name, values }),
        }
    }
    if let Some(AttributeValue::Text(json)) =
        layer.attributes.other.iter().find(|(name, _)| **name == *METADATA_ATTRIBUTE).map(|(_, value)| value)
    {
        picture.metadata = serde_json::from_str(&json.to_string())
            .map_err(|error| fail(format!("its attribute {METADATA_ATTRIBUTE:?} is not a JSON object: {error}")))?;
    }
    Ok(picture)
}

/// JSON in ASCII alone (EXR text is not UTF-8): other characters become `\u` escapes.
fn ascii_json(metadata: &Metadata) -> String {
    let json = serde_json::Value::from_iter(metadata.clone()).to_string();
    let mut ascii = String::with_capacity(json.len());
    for character in json.chars() {
        if character.is_ascii() {
            ascii.push(character);
        } else {
            for unit in character.encode_utf16(&mut [0; 2]) {
                ascii.push_str(&format!("\\u{unit:04x}"));
            }
        }
    }
    ascii
}
