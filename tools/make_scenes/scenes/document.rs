//! A glTF 2.0 document under construction, written as one .glb.

use glam::{Quat, Vec2, Vec3};
use linklight::scene::gltf::write::{Binary, Target, number, numbers};
use linklight::scene::shapes::Shape;
use serde_json::{Map, Value, json};

#[derive(Default)]
pub struct Document {
    name: String,
    pub nodes: Vec<Value>,
    pub meshes: Vec<Value>,
    pub skins: Vec<Value>,
    pub animations: Vec<Value>,
    materials: Vec<Value>,
    textures: Vec<Value>,
    images: Vec<Value>,
    cameras: Vec<Value>,
    lights: Vec<Value>,
    pub binary: Binary,
    emissive_strength: bool,
    unlit: bool,
}

/// A metallic-roughness material. Colours are linear.
#[derive(Clone, Copy)]
pub struct Material {
    pub color: [f32; 3],
    pub metallic: f32,
    pub roughness: f32,
    /// Emitted radiance, W m^-2 sr^-1.
    pub emission: [f32; 3],
    pub texture: Option<usize>,
    pub emission_texture: Option<usize>,
    /// Texture coordinates are metres; the picture repeats every so many.
    pub texture_metres: f32,
    pub double_sided: bool,
    /// Shown as its colour, outside light transport.
    pub unlit: bool,
}

impl Material {
    pub fn matte(r: f32, g: f32, b: f32) -> Self {
        Self {
            color: [r, g, b],
            metallic: 0.0,
            roughness: 1.0,
            emission: [0.0; 3],
            texture: None,
            emission_texture: None,
            texture_metres: 1.0,
            double_sided: false,
            unlit: false,
        }
    }

    pub fn glossy(r: f32, g: f32, b: f32, roughness: f32) -> Self {
        Self { roughness, ..Self::matte(r, g, b) }
    }

    pub fn metal(r: f32, g: f32, b: f32, roughness: f32) -> Self {
        Self { metallic: 1.0, roughness, ..Self::matte(r, g, b) }
    }

    /// Black but for the light it sends out.
    pub fn light(r: f32, g: f32, b: f32) -> Self {
        Self { emission: [r, g, b], ..Self::matte(0.0, 0.0, 0.0) }
    }

    pub fn scaled_emission(self, factor: f32) -> Self {
        Self { emission: self.emission.map(|e| e * factor), ..self }
    }

    pub fn textured(self, texture: usize, metres: f32) -> Self {
        Self { texture: Some(texture), texture_metres: metres, ..self }
    }
}

/// Where a mesh stands: moved, turned about +Y by degrees, scaled.
#[derive(Clone, Copy)]
pub struct Placement {
    pub at: Vec3,
    pub degrees: f32,
    pub scale: Vec3,
}

impl Placement {
    pub fn at(x: f32, y: f32, z: f32) -> Self {
        Self { at: Vec3::new(x, y, z), degrees: 0.0, scale: Vec3::ONE }
    }

    pub fn turned(self, degrees: f32) -> Self {
        Self { degrees, ..self }
    }

    pub fn scaled(self, scale: f32) -> Self {
        Self { scale: Vec3::splat(scale), ..self }
    }
}

impl Document {
    pub fn new(name: &str) -> Self {
        Self { name: name.into(), ..Self::default() }
    }

    pub fn material(&mut self, name: &str, m: Material) -> usize {
        let mut surface = Map::new();
        let [r, g, b] = m.color;
        surface.insert("baseColorFactor".into(), numbers(&[r, g, b, 1.0]));
        surface.insert("metallicFactor".into(), number(m.metallic));
        surface.insert("roughnessFactor".into(), number(m.roughness));
        if let Some(texture) = m.texture {
            surface.insert("baseColorTexture".into(), json!({ "index": texture }));
        }
        let mut material = Map::new();
        material.insert("name".into(), json!(name));
        material.insert("pbrMetallicRoughness".into(), Value::Object(surface));
        let strength = m.emission.iter().fold(0.0, |a: f32, b| a.max(*b));
        if strength > 0.0 {
            material.insert("emissiveFactor".into(), numbers(&m.emission.map(|e| e / strength)));
            if strength != 1.0 {
                let extension = json!({ "KHR_materials_emissive_strength": { "emissiveStrength": number(strength) } });
                material.insert("extensions".into(), extension);
                self.emissive_strength = true;
            }
        }
        if let Some(texture) = m.emission_texture {
            material.insert("emissiveTexture".into(), json!({ "index": texture }));
        }
        if m.unlit {
            material.insert("extensions".into(), json!({ "KHR_materials_unlit": {} }));
            self.unlit = true;
        }
        if m.double_sided {
            material.insert("doubleSided".into(), json!(true));
        }
        // Shapes measure texture coordinates in metres; `primitive` divides by this and drops the note.
        if m.texture.or(m.emission_texture).is_some() {
            material.insert("extras".into(), json!({ "textureMetres": number(m.texture_metres) }));
        }
        self.materials.push(Value::Object(material));
        self.materials.len() - 1
    }

    /// A repeating, mipmapped texture of `size` x `size` pixels; `color` maps (x, y) in 0..1, row 0 at the top, to sRGB.
    pub fn texture(&mut self, name: &str, size: u32, color: impl Fn(f32, f32) -> [f32; 3]) -> usize {
        let picture = image::RgbImage::from_fn(size, size, |x, y| {
            let at = |i: u32| (i as f32 + 0.5) / size as f32;
            image::Rgb(color(at(x), at(y)).map(|c| (c.clamp(0.0, 1.0) * 255.0 + 0.5) as u8))
        });
        let mut png = std::io::Cursor::new(Vec::new());
        picture.write_to(&mut png, image::ImageFormat::Png).expect("an RGB picture in memory can be encoded");
        let view = self.binary.view(&png.into_inner(), Target::Other);
        self.images.push(json!({ "name": name, "mimeType": "image/png", "bufferView": view }));
        self.textures.push(json!({ "source": self.images.len() - 1, "sampler": 0 }));
        self.textures.len() - 1
    }

    /// A primitive of a mesh: `attributes` beyond position and normal may be added to the result.
    pub fn primitive(&mut self, material: usize, shape: &Shape) -> Value {
        let mut attributes = Map::new();
        attributes.insert("POSITION".into(), json!(self.binary.positions(&shape.positions)));
        attributes.insert("NORMAL".into(), json!(self.binary.floats("VEC3", &shape.normals)));
        if let Some(metres) = self.materials[material]["extras"]["textureMetres"].as_f64() {
            let uv: Vec<Vec2> = shape.uv.iter().map(|t| *t / metres as f32).collect();
            attributes.insert("TEXCOORD_0".into(), json!(self.binary.floats("VEC2", &uv)));
        }
        let indices: Vec<u32> = shape.triangles.iter().flatten().copied().collect();
        let accessor = self.binary.indices(&indices, shape.positions.len());
        json!({ "attributes": attributes, "indices": accessor, "material": material })
    }

    pub fn mesh(&mut self, name: &str, parts: &[(usize, Shape)]) -> usize {
        let parts = parts.iter().filter(|(_, shape)| !shape.triangles.is_empty());
        let primitives: Vec<Value> = parts.map(|(material, shape)| self.primitive(*material, shape)).collect();
        self.meshes.push(json!({ "name": name, "primitives": primitives }));
        self.meshes.len() - 1
    }

    /// The same triangles in another material.
    pub fn repainted(&mut self, name: &str, mesh: usize, material: usize) -> usize {
        let mut copy = self.meshes[mesh].clone();
        copy["name"] = json!(name);
        copy["primitives"].as_array_mut().into_iter().flatten().for_each(|p| p["material"] = json!(material));
        self.meshes.push(copy);
        self.meshes.len() - 1
    }

    pub fn place(&mut self, name: &str, mesh: usize, placement: Placement) {
        let mut node = json!({ "name": name, "mesh": mesh });
        if placement.at != Vec3::ZERO {
            node["translation"] = numbers(&placement.at.to_array());
        }
        if placement.degrees != 0.0 {
            let (sin, cos) = linklight::scene::shapes::sin_cos(placement.degrees / 720.0);
            node["rotation"] = numbers(&[0.0, sin, 0.0, cos]);
        }
        if placement.scale != Vec3::ONE {
            node["scale"] = numbers(&placement.scale.to_array());
        }
        self.nodes.push(node);
    }

    /// One mesh of one material, standing where its coordinates say.
    pub fn add(&mut self, name: &str, material: usize, shape: Shape) {
        let mesh = self.mesh(name, &[(material, shape)]);
        self.place(name, mesh, Placement::at(0.0, 0.0, 0.0));
    }

    /// A perspective camera with a vertical field of view in degrees.
    pub fn camera(&mut self, name: &str, eye: [f32; 3], target: [f32; 3], fov_y: f32) {
        let projection = json!({ "yfov": number(fov_y.to_radians()), "znear": 0.02 });
        self.cameras.push(json!({ "name": name, "type": "perspective", "perspective": projection }));
        self.camera_node(name, Vec3::from(eye), Vec3::from(target) - Vec3::from(eye));
    }

    /// An orthographic camera that sees a square of `2 * half` metres a side.
    pub fn orthographic(&mut self, name: &str, eye: [f32; 3], target: [f32; 3], half: f32) {
        let projection = json!({ "xmag": number(half), "ymag": number(half), "znear": 0.01, "zfar": 10 });
        self.cameras.push(json!({ "name": name, "type": "orthographic", "orthographic": projection }));
        self.camera_node(name, Vec3::from(eye), Vec3::from(target) - Vec3::from(eye));
    }

    fn camera_node(&mut self, name: &str, eye: Vec3, direction: Vec3) {
        let node = json!({ "name": name, "camera": self.cameras.len() - 1,
            "translation": numbers(&eye.to_array()), "rotation": looking_along(direction) });
        self.nodes.push(node);
    }

    /// Parallel light; `irradiance` in W/m^2 on a surface that faces it.
    pub fn sun(&mut self, name: &str, direction: [f32; 3], irradiance: [f32; 3]) {
        self.light(name, Vec3::ZERO, Vec3::from(direction), irradiance, json!({ "type": "directional" }));
    }

    /// `intensity` in W/sr.
    pub fn point_light(&mut self, name: &str, at: [f32; 3], intensity: [f32; 3]) {
        self.light(name, Vec3::from(at), Vec3::NEG_Z, intensity, json!({ "type": "point" }));
    }

    /// `intensity` in W/sr; half angles in degrees.
    pub fn spot_light(&mut self, name: &str, at: [f32; 3], target: [f32; 3], intensity: [f32; 3], angles: [f32; 2]) {
        let [inner, outer] = angles.map(|degrees| number(degrees.to_radians()));
        let fields = json!({ "type": "spot", "spot": { "innerConeAngle": inner, "outerConeAngle": outer } });
        self.light(name, Vec3::from(at), Vec3::from(target) - Vec3::from(at), intensity, fields);
    }

    fn light(&mut self, name: &str, at: Vec3, direction: Vec3, intensity: [f32; 3], mut fields: Value) {
        let strength = intensity.iter().fold(0.0, |a: f32, b| a.max(*b));
        fields["name"] = json!(name);
        fields["color"] = numbers(&intensity.map(|i| i / strength));
        fields["intensity"] = number(strength);
        self.lights.push(fields);
        let mut node = json!({ "name": name, "rotation": looking_along(direction),
            "extensions": { "KHR_lights_punctual": { "light": self.lights.len() - 1 } } });
        if at != Vec3::ZERO {
            node["translation"] = numbers(&at.to_array());
        }
        self.nodes.push(node);
    }

    /// The finished file. Nodes that no other node holds are the roots of the scene.
    pub fn glb(mut self) -> Vec<u8> {
        let children: Vec<u64> =
            self.nodes.iter().filter_map(|n| n["children"].as_array()).flatten().filter_map(Value::as_u64).collect();
        let roots: Vec<usize> = (0..self.nodes.len()).filter(|i| !children.contains(&(*i as u64))).collect();
        for material in &mut self.materials {
            if let Some(material) = material.as_object_mut() {
                material.remove("extras");
            }
        }
        let mut root = json!({
            "asset": { "version": "2.0", "generator": "linklight make-scenes", "copyright": "CC0 1.0, the linklight authors" },
            "scene": 0,
            "scenes": [{ "name": self.name, "nodes": roots }],
            "nodes": self.nodes,
            "materials": self.materials,
            "meshes": self.meshes,
            "cameras": self.cameras,
        });
        if !self.textures.is_empty() {
            root["samplers"] = json!([{ "magFilter": 9729, "minFilter": 9987, "wrapS": 10497, "wrapT": 10497 }]);
        }
        let lists = [
            ("textures", self.textures),
            ("images", self.images),
            ("skins", self.skins),
            ("animations", self.animations),
        ];
        for (key, list) in lists {
            if !list.is_empty() {
                root[key] = Value::Array(list);
            }
        }
        let mut used = Vec::new();
        if self.emissive_strength {
            used.push("KHR_materials_emissive_strength");
        }
        if self.unlit {
            used.push("KHR_materials_unlit");
        }
        if !self.lights.is_empty() {
            used.push("KHR_lights_punctual");
            root["extensions"] = json!({ "KHR_lights_punctual": { "lights": self.lights } });
        }
        if !used.is_empty() {
            root["extensionsUsed"] = json!(used);
        }
        self.binary.glb(root).expect("our scenes are far below the 4 GiB of a .glb")
    }
}

/// The rotation, as a glTF quaternion, that turns -Z to `direction` and keeps +Y upwards.
fn looking_along(direction: Vec3) -> Value {
    let back = -direction.normalize_or(Vec3::NEG_Z);
    let up = if back.y.abs() > 0.999 { Vec3::NEG_Z } else { Vec3::Y };
    let right = up.cross(back).normalize_or(Vec3::X);
    let rotation = Quat::from_mat3(&glam::Mat3::from_cols(right, back.cross(right), back));
    numbers(&rotation.normalize().to_array())
}
