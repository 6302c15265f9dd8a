//! Materials: metallic-roughness and the extensions that our material model has a place for.

use super::document::Document;
use super::error::Fault;
use super::json::Object;
use super::texture::Textures;
use crate::scene::Material;
use glam::{Vec3, Vec4};

/// Reads one material; the textures it refers to are gathered in `textures`.
pub fn read(document: &Document, object: &Object, textures: &mut Textures) -> Result<Material, Fault> {
    let mut material = Material { name: object.name(), ..Material::default() };
    let reader = Reader { document };

    if let Some(pbr) = object.object("pbrMetallicRoughness")? {
        material.base_color = reader.color4(&pbr, "baseColorFactor")?;
        material.base_color_texture = textures.reference(document, &pbr, "baseColorTexture", true)?;
        material.metallic = reader.factor(&pbr, "metallicFactor", 1.0, 1.0)?;
        material.roughness = reader.factor(&pbr, "roughnessFactor", 1.0, 1.0)?;
        material.metallic_roughness_texture = textures.reference(document, &pbr, "metallicRoughnessTexture", false)?;
    }
    material.normal_texture = textures.reference(document, object, "normalTexture", false)?;
    if let Some(normal) = object.object("normalTexture")? {
        material.normal_scale = normal.number_or("scale", 1.0)?;
    }
    material.occlusion_texture = textures.reference(document, object, "occlusionTexture", false)?;
    if let Some(occlusion) = object.object("occlusionTexture")? {
        material.occlusion_strength = reader.factor(&occlusion, "strength", 1.0, 1.0)?;
    }
    material.emission = reader.color3(object, "emissiveFactor", Vec3::ZERO)?;
    material.emission_texture = textures.reference(document, object, "emissiveTexture", true)?;
    material.double_sided = object.boolean("doubleSided")?.unwrap_or(false);

    let cutoff = reader.factor(object, "alphaCutoff", 0.5, f32::MAX)?;
    material.alpha_cutoff = match object.text("alphaMode")?.unwrap_or("OPAQUE") {
        "OPAQUE" => None,
        "MASK" => Some(cutoff),
        "BLEND" => {
            document.notes.say("Blended transparency (alphaMode BLEND) is shown as a mask with cutoff 0.5.");
            Some(0.5)
        }
        _ => return Err(object.invalid("alphaMode", "must be OPAQUE, MASK or BLEND")),
    };
    read_extensions(&reader, object, &mut material)?;
    Ok(material)
}

fn read_extensions(reader: &Reader, object: &Object, material: &mut Material) -> Result<(), Fault> {
    if let Some(strength) = object.extension("KHR_materials_emissive_strength")? {
        let strength = reader.factor(&strength, "emissiveStrength", 1.0, f32::MAX)?;
        material.emission = (material.emission * strength).min(Vec3::splat(f32::MAX));
    }
    material.unlit = object.extension("KHR_materials_unlit")?.is_some();
    if let Some(ior) = object.extension("KHR_materials_ior")? {
        let value = ior.number_or("ior", 1.5)?;
        // Zero stands for a mirror-like limit (F0 = 1), and the Fresnel formula gives just that for it.
        material.ior = match value {
            value if value == 0.0 || value >= 1.0 => value,
            _ => {
                reader.out_of_range(&ior, "ior", "1.5");
                1.5
            }
        };
    }
    if let Some(specular) = object.extension("KHR_materials_specular")? {
        material.specular = reader.factor(&specular, "specularFactor", 1.0, 1.0)?;
        material.specular_color = reader.color3(&specular, "specularColorFactor", Vec3::ONE)?;
        for key in ["specularTexture", "specularColorTexture"] {
            if specular.has(key) {
                let note = format!("The {key} of KHR_materials_specular is not supported; its factor alone was taken.");
                reader.document.notes.say(note);
            }
        }
    }
    Ok(())
}

/// Reads factors, bringing those out of range back into it with a note, as viewers do.
struct Reader<'r, 'a> {
    document: &'r Document<'a>,
}

impl Reader<'_, '_> {
    fn out_of_range(&self, object: &Object, key: &str, taken: &str) {
        self.document.notes.say(format!("{} is out of range; {taken} was taken.", object.at(key)));
    }

    fn factor(&self, object: &Object, key: &str, default: f32, max: f32) -> Result<f32, Fault> {
        let value = object.number_or(key, default)?;
        Ok(self.clamp(object, key, value, max))
    }

    fn color3(&self, object: &Object, key: &str, default: Vec3) -> Result<Vec3, Fault> {
        let color = object.numbers::<3>(key)?.unwrap_or(default.to_array());
        // Colours above one occur in emission and specular colour; only negative ones mean nothing.
        Ok(Vec3::from(color.map(|value| self.clamp(object, key, value, f32::MAX))))
    }

    fn color4(&self, object: &Object, key: &str) -> Result<Vec4, Fault> {
        let color = object.numbers::<4>(key)?.unwrap_or([1.0; 4]);
        Ok(Vec4::from(color.map(|value| self.clamp(object, key, value, 1.0))))
    }

    fn clamp(&self, object: &Object, key: &str, value: f32, max: f32) -> f32 {
        let clamped = value.clamp(0.0, max);
        if clamped != value {
            self.out_of_range(object, key, "the nearest allowed value");
        }
        clamped
    }
}
