//! `--edit`: a scene's materials, lights and nodes changed after loading, one property at a time.

use std::fmt;
use std::str::FromStr;

use glam::Vec3;

use super::AppError;
use crate::scene::{Scene, Transform};

/// One property of one material, light or node, set to a value: `material:3.albedo=0.8,0.2,0.1`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edit {
    pub property: Property,
    /// Its place in the file's order.
    pub index: u32,
    /// One number stands in all three.
    pub value: Vec3,
}

/// What can be changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Property {
    /// Base colour, linear, 0..1; a texture is multiplied by it.
    Albedo,
    /// 0..1.
    Roughness,
    /// 0..1.
    Metallic,
    /// Radiance, W m^-2 sr^-1.
    Emission,
    /// W/sr, of directional lights W/m2.
    Intensity,
    /// From where the file has it, metres along its parent's axes; where its translation is animated it stays.
    Move,
}

/// Words of the command line, and the largest value allowed.
const PROPERTIES: [(Property, &str, &str, f32); 6] = [
    (Property::Albedo, "material", "albedo", 1.0),
    (Property::Roughness, "material", "roughness", 1.0),
    (Property::Metallic, "material", "metallic", 1.0),
    (Property::Emission, "material", "emission", 1e9),
    (Property::Intensity, "light", "intensity", 1e9),
    (Property::Move, "node", "move", 1e6),
];

impl Property {
    /// Whether light changes by it but nothing that was linked.
    pub fn keeps_links(self) -> bool {
        matches!(self, Self::Albedo | Self::Intensity)
    }

    fn words(self) -> (&'static str, &'static str) {
        PROPERTIES.iter().find(|row| row.0 == self).map_or(("", ""), |row| (row.1, row.2))
    }
}

impl fmt::Display for Edit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (kind, name) = self.property.words();
        write!(f, "{kind}:{}.{name}={},{},{}", self.index, self.value.x, self.value.y, self.value.z)
    }
}

impl FromStr for Edit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let form = || {
            let all: Vec<String> = PROPERTIES.iter().map(|row| format!("{}:N.{}", row.1, row.2)).collect();
            format!("expected PROPERTY=VALUE or =R,G,B with a property of {}", all.join(", "))
        };
        let (what, value) = text.split_once('=').ok_or_else(form)?;
        let (kind, rest) = what.split_once(':').ok_or_else(form)?;
        let (index, name) = rest.split_once('.').ok_or_else(form)?;
        let row = PROPERTIES.iter().find(|row| (row.1, row.2) == (kind, name)).ok_or_else(form)?;
        let index = index.parse().map_err(|_| form())?;
        let numbers: Option<Vec<f32>> = value.split(',').map(|number| number.trim().parse().ok()).collect();
        let value = match numbers.as_deref() {
            Some(&[x]) => Vec3::splat(x),
            Some(&[x, y, z]) => Vec3::new(x, y, z),
            _ => return Err(form()),
        };
        let least = if row.0 == Property::Move { -row.3 } else { 0.0 };
        if !value.to_array().iter().all(|number| (least..=row.3).contains(number)) {
            return Err(format!("{kind}:{index}.{name} is {least} to {}", row.3));
        }
        Ok(Self { property: row.0, index, value })
    }
}

/// What edits change, as the file has it.
#[derive(Debug, Clone)]
pub struct Originals {
    materials: Vec<crate::scene::Material>,
    lights: Vec<crate::scene::Light>,
    nodes: Vec<Transform>,
}

impl Originals {
    pub fn of(scene: &Scene) -> Self {
        Self {
            materials: scene.materials.clone(),
            lights: scene.lights.clone(),
            nodes: scene.nodes.iter().map(|node| node.transform).collect(),
        }
    }

    /// Gives `scene` back what the file says, then makes the edits; the last of a property stands.
    pub fn edit(&self, scene: &mut Scene, edits: &[Edit]) -> Result<(), AppError> {
        scene.materials.clone_from(&self.materials);
        scene.lights.clone_from(&self.lights);
        scene.nodes.iter_mut().zip(&self.nodes).for_each(|(node, transform)| node.transform = *transform);
        edits.iter().try_for_each(|edit| apply(scene, edit))
    }
}

/// Makes one edit; fails where the scene has no such thing.
pub fn apply(scene: &mut Scene, edit: &Edit) -> Result<(), AppError> {
    let index = edit.index as usize;
    let absent = |count: usize| {
        let (kind, _) = edit.property.words();
        AppError::Usage(format!("--edit {edit}: the scene has {count} of the kind {kind}, counted from 0"))
    };
    match edit.property {
        Property::Intensity => {
            let count = scene.lights.len();
            scene.lights.get_mut(index).ok_or_else(|| absent(count))?.intensity = edit.value;
        }
        Property::Move => {
            let count = scene.nodes.len();
            match &mut scene.nodes.get_mut(index).ok_or_else(|| absent(count))?.transform {
                Transform::Trs { translation, .. } => *translation += edit.value,
                Transform::Matrix(matrix) => matrix.w_axis += edit.value.extend(0.0),
            }
        }
        Property::Albedo | Property::Roughness | Property::Metallic | Property::Emission => {
            let count = scene.materials.len();
            let material = scene.materials.get_mut(index).ok_or_else(|| absent(count))?;
            match edit.property {
                Property::Albedo => material.base_color = edit.value.extend(material.base_color.w),
                Property::Roughness => material.roughness = edit.value.x,
                Property::Metallic => material.metallic = edit.value.x,
                _ => material.emission = edit.value,
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{LoadOptions, open};

    #[test]
    fn edits_read_back_as_they_are_written() {
        for text in ["material:3.albedo=0.8,0.25,0.1", "light:0.intensity=1e3,0,7.5", "node:12.move=-1,0.5,1e-3"] {
            let edit: Edit = text.parse().unwrap();
            assert_eq!(edit.to_string().parse(), Ok(edit), "{text}");
        }
        assert_eq!("material:1.roughness=0.5".parse::<Edit>().unwrap().value, Vec3::splat(0.5));
        for bad in [
            "",
            "material",
            "material:1.albedo",
            "material:1.albedo=2",
            "material:1.albedo=0,0",
            "light:0.albedo=0",
            "light:x.intensity=0",
            "light:0.intensity=-1",
            "node:0.move=nan",
            "node:0.move=1e7",
        ] {
            assert!(bad.parse::<Edit>().is_err(), "{bad:?}");
        }
    }

    #[test]
    fn edits_start_from_the_file_each_time() {
        let mut scene = open("builtin:cornell-box", &LoadOptions::default()).unwrap();
        let originals = Originals::of(&scene);
        let color = scene.materials[0].base_color;
        let edit = |text: &str| text.parse::<Edit>().unwrap();
        originals.edit(&mut scene, &[edit("material:0.albedo=0.5"), edit("node:0.move=1,0,0")]).unwrap();
        originals.edit(&mut scene, &[edit("node:0.move=1,0,0"), edit("material:0.roughness=0.25")]).unwrap();
        assert_eq!((scene.materials[0].base_color, scene.materials[0].roughness), (color, 0.25));
        originals.edit(&mut scene, &[]).unwrap();
        let moved = |a: &Transform, b: &Transform| a != b;
        assert!(!scene.nodes.iter().zip(&originals.nodes).any(|(node, old)| moved(&node.transform, old)));
        let missing = originals.edit(&mut scene, &[edit("light:99.intensity=1")]).unwrap_err();
        assert!(missing.to_string().contains("light:99"), "{missing}");
    }
}
