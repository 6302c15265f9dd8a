//! The baked .glb: the surfaces as they stand, in unlit materials that show the light, or in their own beside it.

use glam::{Mat4, Vec2, Vec3, Vec4};
use serde_json::{Value, json};

use super::pieces::Piece;
use super::solution::ElementLight;
use crate::app::AppError;
use crate::app::stage::Stage;
use crate::scene::deform::WorldVertices;
use crate::scene::gltf::write::{Binary, number, numbers};
use crate::scene::gltf::write_materials::MaterialWriter;
use crate::scene::{Image, Material, Projection};

/// What goes into the file.
pub struct Contents<'a> {
    pub stage: &'a Stage,
    pub vertices: &'a WorldVertices,
    pub light: &'a ElementLight,
    pub pieces: &'a [Piece],
    /// Radiance that is shown as white.
    pub scale: f32,
    /// Surfaces keep their materials; the light lies beside them.
    pub keeps_materials: bool,
    /// Base colours are reflected whole, as with `--diffuse`.
    pub is_diffuse: bool,
    /// What the texels show, where the light lies in a lightmap.
    pub lightmap: Option<Image>,
    /// What the file says about itself.
    pub extras: Value,
}

/// How a piece shows its light.
enum Shown {
    /// As the scene had it.
    Original,
    /// Its base colour and texture, times the light at its vertices.
    BaseColor,
    /// What its vertices send.
    Vertices,
    Lightmap,
}

const UNLIT: &str = "KHR_materials_unlit";

impl Contents<'_> {
    pub fn glb(&self) -> Result<Vec<u8>, AppError> {
        let mut binary = Binary::default();
        let mut materials = MaterialWriter::default();
        let lightmap = match &self.lightmap {
            Some(picture) if !self.keeps_materials => {
                let sampler = json!({ "magFilter": 9729, "minFilter": 9729, "wrapS": 33071, "wrapT": 33071 });
                Some(materials.texture(&mut binary, picture, sampler).map_err(AppError::failed)?)
            }
            _ => None,
        };
        let lightmap_set = self.lightmap_set();
        let mut primitives = Vec::new();
        for piece in self.pieces {
            let shown = self.shown(piece);
            let material = self.material(&mut binary, &mut materials, piece, &shown, lightmap)?;
            let attributes = self.attributes(&mut binary, piece, &shown, lightmap_set);
            let indices: Vec<u32> = piece.triangles.as_flattened().to_vec();
            let indices = binary.indices(&indices, piece.vertices.len());
            primitives.push(json!({ "attributes": attributes, "indices": indices, "material": material }));
        }
        let scene = &self.stage.scene;
        let mut nodes = vec![json!({ "name": "baked", "mesh": 0 })];
        let mut cameras = Vec::new();
        for camera in &self.stage.pose.cameras {
            let name = &scene.cameras[camera.camera as usize].name;
            cameras.push(projection(name, camera.projection));
            let matrix = rigid(camera.world_from_camera);
            let index = cameras.len() - 1;
            nodes.push(json!({ "name": name, "camera": index, "matrix": numbers(&matrix.to_cols_array()) }));
        }
        let generator = concat!("linklight ", env!("CARGO_PKG_VERSION"));
        let mut root = json!({
            "asset": { "version": "2.0", "generator": generator, "extras": { "linklight": self.extras } },
            "scene": 0,
            "scenes": [{ "name": scene.name, "nodes": (0..nodes.len()).collect::<Vec<_>>() }],
            "nodes": nodes,
            "meshes": [{ "name": "baked", "primitives": primitives }],
        });
        if !cameras.is_empty() {
            root["cameras"] = Value::Array(cameras);
        }
        materials.finish(&mut root);
        binary.glb(root).ok_or_else(|| {
            AppError::failed("the baked file would exceed the 4 GiB of a .glb; use fewer elements (--elements)")
        })
    }

    /// The UV set of the lightmap: the second, or the third where the scene's materials need the second.
    pub fn lightmap_set(&self) -> u32 {
        if self.keeps_materials && self.stage.scene.materials.iter().any(|material| uv_sets(material) == 2) {
            2
        } else {
            1
        }
    }

    fn original(&self, piece: &Piece) -> &Material {
        let part = self.stage.geometry.parts[piece.part];
        &self.stage.scene.materials[part.material as usize]
    }

    fn shown(&self, piece: &Piece) -> Shown {
        let material = self.original(piece);
        let is_metal_by_texture = material.metallic_roughness_texture.is_some() && !self.is_diffuse;
        if self.keeps_materials {
            Shown::Original
        } else if self.lightmap.is_some() && material.alpha_cutoff.is_none() && !material.unlit {
            Shown::Lightmap
        } else if !material.unlit && (material.emission != Vec3::ZERO || is_metal_by_texture) {
            Shown::Vertices
        } else {
            // Holes come from the base texture, also where all else is in a lightmap.
            Shown::BaseColor
        }
    }

    fn material(
        &self,
        binary: &mut Binary,
        materials: &mut MaterialWriter,
        piece: &Piece,
        shown: &Shown,
        lightmap: Option<usize>,
    ) -> Result<usize, AppError> {
        let original = self.original(piece);
        let unlit = json!({ UNLIT: {} });
        let mut object = match shown {
            Shown::Original => {
                let scene = &self.stage.scene;
                let object = materials.material(scene, binary, original, false).map_err(AppError::failed)?;
                return Ok(materials.push(object, &[]));
            }
            Shown::BaseColor => {
                let mut surface = json!({ "baseColorFactor": numbers(&original.base_color.to_array()) });
                if let Some(texture) = original.base_color_texture {
                    let reference = materials.reference(&self.stage.scene, binary, texture);
                    surface["baseColorTexture"] = reference.map_err(AppError::failed)?;
                }
                json!({ "pbrMetallicRoughness": surface })
            }
            Shown::Vertices => json!({}),
            Shown::Lightmap => {
                let texture = json!({ "index": lightmap, "texCoord": 1 });
                json!({ "pbrMetallicRoughness": { "baseColorTexture": texture } })
            }
        };
        object["name"] = json!(original.name);
        object["extensions"] = unlit;
        if let (Some(cutoff), Shown::BaseColor) = (original.alpha_cutoff, shown) {
            object["alphaMode"] = json!("MASK");
            object["alphaCutoff"] = number(cutoff);
        }
        Ok(materials.push(object, &[UNLIT]))
    }

    fn attributes(&self, binary: &mut Binary, piece: &Piece, shown: &Shown, lightmap_set: u32) -> Value {
        let geometry = &self.stage.geometry;
        let pick = |all: &[Vec3]| -> Vec<Vec3> { piece.vertices.iter().map(|&vertex| all[vertex as usize]).collect() };
        let side = if piece.is_back { -1.0 } else { 1.0 };
        let normals: Vec<Vec3> = pick(&self.vertices.normals).into_iter().map(|normal| side * normal).collect();
        let mut attributes = json!({
            "POSITION": binary.positions(&pick(&self.vertices.positions)),
            "NORMAL": binary.floats("VEC3", &normals),
        });
        let uv = |set: usize| -> Vec<Vec2> { piece.vertices.iter().map(|&v| geometry.uv[set][v as usize]).collect() };
        let original = self.original(piece);
        let has_place = !piece.places.is_empty() && matches!(shown, Shown::Original | Shown::Lightmap);
        let needed = match shown {
            Shown::Original => uv_sets(original),
            Shown::BaseColor => original.base_color_texture.map_or(0, |texture| texture.uv_set + 1),
            Shown::Vertices | Shown::Lightmap => 0,
        };
        // Sets are numbered without gaps.
        for set in 0..needed.max(if has_place { lightmap_set.min(2) } else { 0 }) {
            if !(has_place && set == lightmap_set) {
                attributes[format!("TEXCOORD_{set}")] = json!(binary.floats("VEC2", &uv(set as usize)));
            }
        }
        if has_place {
            attributes[format!("TEXCOORD_{lightmap_set}")] = json!(binary.floats("VEC2", &piece.places));
        }
        if matches!(shown, Shown::Lightmap) {
            return attributes;
        }
        let element =
            |vertex: u32| if piece.is_back { self.light.back_elements[vertex as usize] } else { vertex } as usize;
        let light: Vec<Vec3> = piece.vertices.iter().map(|&v| self.light.irradiance[element(v)]).collect();
        attributes["_IRRADIANCE"] = json!(binary.floats("VEC3", &light));
        let colors: Vec<[f32; 4]> = piece
            .vertices
            .iter()
            .map(|&vertex| {
                let color = geometry.colors[vertex as usize];
                match shown {
                    Shown::Original => color,
                    Shown::Vertices => self.sent(element(vertex)).extend(1.0),
                    _ => (color.truncate() * self.reflected(original, element(vertex))).extend(color.w),
                }
                .clamp(Vec4::ZERO, Vec4::ONE)
                .to_array()
            })
            .collect();
        attributes["COLOR_0"] = json!(binary.floats("VEC4", &colors));
        attributes
    }

    /// What an element sends, of white.
    fn sent(&self, element: usize) -> Vec3 {
        let light = self.light;
        let reflected = light.albedo[element] * light.irradiance[element] / std::f32::consts::PI;
        (light.emission[element] + reflected) / self.scale
    }

    /// What a surface of base colour 1 would send, of white.
    fn reflected(&self, material: &Material, element: usize) -> Vec3 {
        if material.unlit {
            return Vec3::splat(1.0 / self.scale);
        }
        let diffuse = if self.is_diffuse { 1.0 } else { 1.0 - material.metallic };
        diffuse * self.light.irradiance[element] / (std::f32::consts::PI * self.scale)
    }
}

/// UV sets that the material's textures need, from the first.
fn uv_sets(material: &Material) -> u32 {
    let textures = [
        material.base_color_texture,
        material.metallic_roughness_texture,
        material.normal_texture,
        material.occlusion_texture,
        material.emission_texture,
    ];
    textures.into_iter().flatten().map(|texture| texture.uv_set + 1).max().unwrap_or(0)
}

/// Without the scale that a camera does not have.
fn rigid(world_from_camera: Mat4) -> Mat4 {
    let (_, rotation, translation) = world_from_camera.to_scale_rotation_translation();
    Mat4::from_rotation_translation(rotation, translation)
}

fn projection(name: &str, projection: Projection) -> Value {
    match projection {
        Projection::Perspective { fov_y, near, far } => {
            let mut object = json!({ "yfov": number(fov_y), "znear": number(near) });
            if let Some(far) = far {
                object["zfar"] = number(far);
            }
            json!({ "name": name, "type": "perspective", "perspective": object })
        }
        Projection::Orthographic { half_width, half_height, near, far } => {
            let object = json!({ "xmag": number(half_width), "ymag": number(half_height),
                "znear": number(near), "zfar": number(far) });
            json!({ "name": name, "type": "orthographic", "orthographic": object })
        }
    }
}
