//! Textures, samplers and the references to them: which images a scene needs, and as what.

use super::document::Document;
use super::error::Fault;
use super::image;
use super::json::Object;
use crate::scene::{Image, Material, Texture, TextureRef, Wrap};
use std::collections::HashMap;

/// Gathers the textures that materials refer to, then decodes their images.
///
/// A texture read as colour and one read as numbers are two textures, since decoding differs.
#[derive(Debug, Default)]
pub struct Textures {
    textures: Vec<Texture>,
    by_file_index: HashMap<(usize, bool), Option<u32>>,
    /// The file's image index, and whether it holds sRGB colour.
    images: Vec<(usize, bool)>,
    image_by_file_index: HashMap<(usize, bool), u32>,
}

impl Textures {
    /// Reads the texture reference `owner.key`. `None` when there is none, or none that can be used (which is noted).
    pub fn reference(
        &mut self,
        document: &Document,
        owner: &Object,
        key: &str,
        srgb: bool,
    ) -> Result<Option<TextureRef>, Fault> {
        let Some(info) = owner.object(key)? else { return Ok(None) };
        let textures = document.list("textures")?;
        let index = info.require("index", info.index("index", "textures", textures.len())?)?;
        let mut uv_set = info.integer("texCoord")?.unwrap_or(0);
        let mut transform = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        if let Some(extension) = info.extension("KHR_texture_transform")? {
            transform = texture_transform(&extension)?;
            uv_set = extension.integer("texCoord")?.unwrap_or(uv_set);
        }
        if uv_set > 1 {
            let pointer = info.pointer();
            document.notes.say(format!("{pointer}: only TEXCOORD_0 and TEXCOORD_1 are read; the texture was ignored."));
            return Ok(None);
        }
        let texture = match self.by_file_index.get(&(index, srgb)) {
            Some(texture) => *texture,
            None => {
                let texture = self.read(document, &textures.object(index)?, srgb)?;
                self.by_file_index.insert((index, srgb), texture);
                texture
            }
        };
        Ok(texture.map(|texture| TextureRef { texture, uv_set: uv_set as u32, transform }))
    }

    fn read(&mut self, document: &Document, texture: &Object, srgb: bool) -> Result<Option<u32>, Fault> {
        let images = document.list("images")?;
        let Some(source) = texture.index("source", "images", images.len())? else {
            let pointer = texture.pointer();
            document.notes.say(format!("{pointer} has no PNG or JPEG image and was ignored."));
            return Ok(None);
        };
        let samplers = document.list("samplers")?;
        let sampler = texture.index("sampler", "samplers", samplers.len())?;
        let sampler = sampler.map(|index| samplers.object(index)).transpose()?;
        let next_image = self.images.len() as u32;
        let image = *self.image_by_file_index.entry((source, srgb)).or_insert(next_image);
        if image == next_image {
            self.images.push((source, srgb));
        }
        self.textures.push(read_sampler(document, sampler, image)?);
        Ok(Some(self.textures.len() as u32 - 1))
    }

    /// Decodes the images, takes unreadable ones out of `materials` with a note, and numbers the rest without gaps.
    pub fn finish(self, document: &Document, materials: &mut [Material]) -> Result<(Vec<Texture>, Vec<Image>), Fault> {
        let decoded = image::decode(document, &self.images)?;
        let mut images = Vec::new();
        let mut image_remap = Vec::new();
        for image in decoded {
            image_remap.push(image.is_some().then_some(images.len() as u32));
            images.extend(image);
        }
        let mut textures = Vec::new();
        let mut texture_remap = Vec::new();
        for texture in self.textures {
            let image = image_remap[texture.image as usize];
            texture_remap.push(image.is_some().then_some(textures.len() as u32));
            textures.extend(image.map(|image| Texture { image, ..texture }));
        }
        for reference in materials.iter_mut().flat_map(references) {
            *reference = reference.and_then(|reference| {
                let texture = texture_remap[reference.texture as usize]?;
                Some(TextureRef { texture, ..reference })
            });
        }
        Ok((textures, images))
    }
}

fn references(material: &mut Material) -> [&mut Option<TextureRef>; 5] {
    [
        &mut material.base_color_texture,
        &mut material.metallic_roughness_texture,
        &mut material.normal_texture,
        &mut material.occlusion_texture,
        &mut material.emission_texture,
    ]
}

/// KHR_texture_transform: uv' = translation * rotation * scale * uv, the rotation counter-clockwise in an image whose
/// v axis runs down.
fn texture_transform(extension: &Object) -> Result<[[f32; 3]; 2], Fault> {
    let [x, y] = extension.numbers("offset")?.unwrap_or([0.0, 0.0]);
    let [scale_u, scale_v] = extension.numbers("scale")?.unwrap_or([1.0, 1.0]);
    let (sin, cos) = extension.number_or("rotation", 0.0)?.sin_cos();
    Ok([[cos * scale_u, sin * scale_v, x], [-sin * scale_u, cos * scale_v, y]])
}

fn read_sampler(document: &Document, sampler: Option<Object>, image: u32) -> Result<Texture, Fault> {
    let mut texture = Texture {
        image,
        wrap: [Wrap::Repeat; 2],
        mag_linear: true,
        min_linear: true,
        mipmapped: true,
        mip_linear: true,
    };
    let Some(sampler) = sampler else { return Ok(texture) };
    let unknown = |key| {
        let pointer = sampler.at(key);
        document.notes.say(format!("{pointer} has a value glTF does not define; the default was taken."));
    };
    for (wrap, key) in texture.wrap.iter_mut().zip(["wrapS", "wrapT"]) {
        match sampler.integer(key)? {
            None | Some(10497) => {}
            Some(33648) => *wrap = Wrap::MirroredRepeat,
            Some(33071) => *wrap = Wrap::ClampToEdge,
            Some(_) => unknown(key),
        }
    }
    match sampler.integer("magFilter")? {
        None | Some(9729) => {}
        Some(9728) => texture.mag_linear = false,
        Some(_) => unknown("magFilter"),
    }
    // NEAREST, LINEAR, then {NEAREST, LINEAR}_MIPMAP_NEAREST and {NEAREST, LINEAR}_MIPMAP_LINEAR.
    (texture.min_linear, texture.mipmapped, texture.mip_linear) = match sampler.integer("minFilter")? {
        None | Some(9987) => (true, true, true),
        Some(9728) => (false, false, false),
        Some(9729) => (true, false, false),
        Some(9984) => (false, true, false),
        Some(9985) => (true, true, false),
        Some(9986) => (false, true, true),
        Some(_) => {
            unknown("minFilter");
            (true, true, true)
        }
    };
    Ok(texture)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn transformed(extension: serde_json::Value, uv: [f32; 2]) -> [f32; 2] {
        let rows = texture_transform(&Object::root(&extension).unwrap()).unwrap();
        rows.map(|[a, b, c]| a * uv[0] + b * uv[1] + c)
    }

    #[test]
    fn texture_transform_scales_then_rotates_then_moves() {
        assert_eq!(transformed(json!({}), [0.25, 0.75]), [0.25, 0.75]);
        assert_eq!(transformed(json!({ "offset": [1, 2], "scale": [2, 4] }), [0.5, 0.5]), [2.0, 4.0]);
        // A quarter turn takes the u axis to -v (up in the image) and the v axis to +u.
        let quarter = std::f32::consts::FRAC_PI_2;
        let near = |a: [f32; 2], b: [f32; 2]| (a[0] - b[0]).abs() < 1e-6 && (a[1] - b[1]).abs() < 1e-6;
        assert!(near(transformed(json!({ "rotation": quarter }), [1.0, 0.0]), [0.0, -1.0]));
        assert!(near(transformed(json!({ "rotation": quarter }), [0.0, 1.0]), [1.0, 0.0]));
        let all = json!({ "offset": [0.5, 0.5], "rotation": quarter, "scale": [2, 3] });
        assert!(near(transformed(all, [1.0, 1.0]), [3.5, -1.5]));
    }
}
