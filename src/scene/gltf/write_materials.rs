//! Materials, textures and images of a [`Scene`] as glTF objects: the reading side, turned around.

use std::io::Cursor;

use serde_json::{Map, Value, json};

use super::write::{Binary, Target, number, numbers};
use crate::scene::{Image, Material, Scene, Texture, TextureRef, Wrap};

/// The lists that materials of a file draw on.
#[derive(Debug, Default)]
pub struct MaterialWriter {
    materials: Vec<Value>,
    textures: Vec<Value>,
    samplers: Vec<Value>,
    images: Vec<Value>,
    /// Written texture of each texture of the scene.
    known: std::collections::HashMap<u32, usize>,
    extensions: std::collections::BTreeSet<&'static str>,
}

/// A picture that could not be encoded as PNG.
#[derive(Debug, thiserror::Error)]
#[error("cannot encode the picture {name:?} ({width} x {height}) as PNG: {source}")]
pub struct EncodeError {
    pub name: String,
    pub width: u32,
    pub height: u32,
    pub source: image::ImageError,
}

impl MaterialWriter {
    /// A finished material object, kept once; `extensions` are those it uses.
    pub fn push(&mut self, material: Value, extensions: &[&'static str]) -> usize {
        self.extensions.extend(extensions);
        self.materials.iter().position(|known| *known == material).unwrap_or_else(|| {
            self.materials.push(material);
            self.materials.len() - 1
        })
    }

    /// The object of `material` as it was read. `double_sided` overrides the material's own.
    pub fn material(
        &mut self,
        scene: &Scene,
        binary: &mut Binary,
        material: &Material,
        double_sided: bool,
    ) -> Result<Value, EncodeError> {
        let mut surface = Map::new();
        surface.insert("baseColorFactor".into(), numbers(&material.base_color.to_array()));
        surface.insert("metallicFactor".into(), number(material.metallic));
        surface.insert("roughnessFactor".into(), number(material.roughness));
        let mut object = json!({ "name": material.name, "doubleSided": double_sided });
        for (key, reference) in [
            ("baseColorTexture", material.base_color_texture),
            ("metallicRoughnessTexture", material.metallic_roughness_texture),
        ] {
            if let Some(reference) = reference {
                surface.insert(key.into(), self.reference(scene, binary, reference)?);
            }
        }
        object["pbrMetallicRoughness"] = Value::Object(surface);
        if let Some(reference) = material.normal_texture {
            object["normalTexture"] = self.reference(scene, binary, reference)?;
            object["normalTexture"]["scale"] = number(material.normal_scale);
        }
        if let Some(reference) = material.occlusion_texture {
            object["occlusionTexture"] = self.reference(scene, binary, reference)?;
            object["occlusionTexture"]["strength"] = number(material.occlusion_strength);
        }
        if let Some(reference) = material.emission_texture {
            object["emissiveTexture"] = self.reference(scene, binary, reference)?;
        }
        if let Some(cutoff) = material.alpha_cutoff {
            object["alphaMode"] = json!("MASK");
            object["alphaCutoff"] = number(cutoff);
        }
        let mut extensions = Map::new();
        let strength = material.emission.max_element();
        if strength > 0.0 {
            object["emissiveFactor"] = numbers(&(material.emission / strength.max(1.0)).to_array());
            if strength > 1.0 {
                extensions
                    .insert("KHR_materials_emissive_strength".into(), json!({ "emissiveStrength": number(strength) }));
            }
        }
        if material.unlit {
            extensions.insert("KHR_materials_unlit".into(), json!({}));
        }
        let defaults = Material::default();
        if material.ior != defaults.ior {
            extensions.insert("KHR_materials_ior".into(), json!({ "ior": number(material.ior) }));
        }
        if (material.specular, material.specular_color) != (defaults.specular, defaults.specular_color) {
            let color = numbers(&material.specular_color.to_array());
            let specular = json!({ "specularFactor": number(material.specular), "specularColorFactor": color });
            extensions.insert("KHR_materials_specular".into(), specular);
        }
        for name in
            ["KHR_materials_emissive_strength", "KHR_materials_unlit", "KHR_materials_ior", "KHR_materials_specular"]
        {
            if extensions.contains_key(name) {
                self.extensions.insert(name);
            }
        }
        if !extensions.is_empty() {
            object["extensions"] = Value::Object(extensions);
        }
        Ok(object)
    }

    /// The object that refers to a texture of the scene; its picture is written once.
    pub fn reference(
        &mut self,
        scene: &Scene,
        binary: &mut Binary,
        reference: TextureRef,
    ) -> Result<Value, EncodeError> {
        let index = match self.known.get(&reference.texture) {
            Some(&index) => index,
            None => {
                let texture = scene.textures[reference.texture as usize];
                let picture = &scene.images[texture.image as usize];
                let index = self.texture(binary, picture, sampler(texture))?;
                self.known.insert(reference.texture, index);
                index
            }
        };
        let mut object = json!({ "index": index, "texCoord": reference.uv_set });
        if let Some(transform) = transform(reference.transform) {
            self.extensions.insert("KHR_texture_transform");
            object["extensions"] = json!({ "KHR_texture_transform": transform });
        }
        Ok(object)
    }

    /// A texture of its own.
    pub fn texture(&mut self, binary: &mut Binary, picture: &Image, sampler: Value) -> Result<usize, EncodeError> {
        let bytes = encode(picture)?;
        let view = binary.view(&bytes, Target::Other);
        self.images.push(json!({ "name": picture.name, "mimeType": "image/png", "bufferView": view }));
        let sampler = self.samplers.iter().position(|known| *known == sampler).unwrap_or_else(|| {
            self.samplers.push(sampler);
            self.samplers.len() - 1
        });
        self.textures.push(json!({ "source": self.images.len() - 1, "sampler": sampler }));
        Ok(self.textures.len() - 1)
    }

    /// Adds the lists to the root of a file.
    pub fn finish(self, root: &mut Value) {
        let lists = [
            ("materials", self.materials),
            ("textures", self.textures),
            ("samplers", self.samplers),
            ("images", self.images),
        ];
        for (key, list) in lists.into_iter().filter(|(_, list)| !list.is_empty()) {
            root[key] = Value::Array(list);
        }
        if !self.extensions.is_empty() {
            root["extensionsUsed"] = json!(self.extensions);
        }
    }
}

fn encode(picture: &Image) -> Result<Vec<u8>, EncodeError> {
    let mut bytes = Cursor::new(Vec::new());
    let (width, height) = (picture.width, picture.height);
    image::write_buffer_with_format(
        &mut bytes,
        &picture.rgba,
        width,
        height,
        image::ExtendedColorType::Rgba8,
        image::ImageFormat::Png,
    )
    .map_err(|source| EncodeError { name: picture.name.clone(), width, height, source })?;
    Ok(bytes.into_inner())
}

fn sampler(texture: Texture) -> Value {
    let [s, t] = texture.wrap.map(|wrap| match wrap {
        Wrap::Repeat => 10497,
        Wrap::MirroredRepeat => 33648,
        Wrap::ClampToEdge => 33071,
    });
    let min = match (texture.mipmapped, texture.min_linear, texture.mip_linear) {
        (false, false, _) => 9728,
        (false, true, _) => 9729,
        (true, false, false) => 9984,
        (true, true, false) => 9985,
        (true, false, true) => 9986,
        (true, true, true) => 9987,
    };
    json!({ "wrapS": s, "wrapT": t, "magFilter": if texture.mag_linear { 9729 } else { 9728 }, "minFilter": min })
}

/// KHR_texture_transform of the rows of a matrix, which came from one; `None` for the identity.
fn transform([[a, b, x], [c, d, y]]: [[f32; 3]; 2]) -> Option<Value> {
    if ([a, b, x], [c, d, y]) == ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]) {
        return None;
    }
    // a = cos su, c = -sin su, b = sin sv, d = cos sv. A mirrored transform turns its second axis around.
    let (scale_u, scale_v) = (a.hypot(c), b.hypot(d));
    let rotation = if scale_u > 0.0 { (-c).atan2(a) } else { b.atan2(d) };
    let sign = if a * d - b * c < 0.0 { -1.0 } else { 1.0 };
    Some(json!({
        "offset": numbers(&[x, y]),
        "rotation": number(rotation),
        "scale": numbers(&[scale_u, sign * scale_v]),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::load_bytes;
    use glam::{Vec3, Vec4};

    fn scene() -> Scene {
        let image = Image {
            name: "checks".into(),
            width: 2,
            height: 1,
            rgba: vec![255, 0, 0, 255, 0, 255, 0, 128],
            srgb: true,
        };
        let texture = Texture {
            image: 0,
            wrap: [Wrap::ClampToEdge, Wrap::MirroredRepeat],
            mag_linear: false,
            min_linear: true,
            mipmapped: true,
            mip_linear: false,
        };
        let rows = [[0.0, -3.0, 0.25], [-2.0, 0.0, 0.5]];
        let material = Material {
            name: "all of it".into(),
            base_color: Vec4::new(0.5, 0.25, 0.125, 1.0),
            base_color_texture: Some(TextureRef { texture: 0, uv_set: 0, transform: rows }),
            metallic: 0.25,
            roughness: 0.75,
            emission: Vec3::new(4.0, 2.0, 1.0),
            alpha_cutoff: Some(0.25),
            double_sided: true,
            ior: 1.33,
            specular: 0.5,
            ..Material::default()
        };
        Scene { materials: vec![material], textures: vec![texture], images: vec![image], ..Scene::default() }
    }

    #[test]
    fn what_is_written_is_read_back() {
        let scene = scene();
        let mut binary = Binary::default();
        let mut writer = MaterialWriter::default();
        let material = writer.material(&scene, &mut binary, &scene.materials[0], true).unwrap();
        writer.push(material, &[]);
        let positions = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let attributes = json!({ "POSITION": binary.positions(&positions), "TEXCOORD_0": binary.floats("VEC2", &[0.0f32; 6].map(|x| [x, x])[..3]) });
        let mut root = json!({ "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
            "meshes": [{ "primitives": [{ "attributes": attributes, "material": 0 }] }] });
        writer.finish(&mut root);
        let glb = binary.glb(root).unwrap();
        let read = load_bytes("written.glb", &glb).unwrap();
        let (written, read_back) = (&scene.materials[0], &read.materials[0]);
        assert_eq!(read.images[0].rgba, scene.images[0].rgba);
        assert_eq!(read.textures[0], scene.textures[0]);
        let rows = read_back.base_color_texture.unwrap().transform;
        for (row, expected) in rows.iter().zip(&written.base_color_texture.unwrap().transform) {
            assert!(row.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{rows:?}");
        }
        let comparable = |m: &Material| Material { base_color_texture: None, ..m.clone() };
        assert_eq!(format!("{:?}", comparable(read_back)), format!("{:?}", comparable(written)));
    }

    #[test]
    fn the_identity_needs_no_extension() {
        assert_eq!(transform([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), None);
        assert!(transform([[1.0, 0.0, 0.5], [0.0, 1.0, 0.0]]).is_some());
    }
}
