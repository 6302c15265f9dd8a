//! The scene on the device: static tables, and world-space vertices made anew for each pose by one compute pass.
//!
//! Every stage and method reads the same buffers, in the layout of `glsl/lib/scene.glsl`. What changes per frame
//! without a rebuild: the pose (node, joint and morph animation), lights, environment, materials.

use crate::gpu::shaders::types::{
    EnvironmentCell, EnvironmentInfo, Influence, Light, LocalVertex, Material, MorphDelta, Part, TextureSlot,
    VertexAttributes,
};
use crate::gpu::shaders::world::{Deform, DeformParams};
use crate::gpu::{
    AddressMode, Buffer, Context, Format, GpuError, Image, ImageDescription, Recorder, Sampler, SamplerDescription,
    Shape, TextureTable,
};
use crate::scene::deform::normal_matrix;
use crate::scene::environment::Environment;
use crate::scene::environment::sampling::EnvironmentSampler;
use crate::scene::geometry::Geometry;
use crate::scene::pose::{Pose, PosedLight};
use crate::scene::{self, LightKind, Scene};
use glam::{Mat3, Mat4, UVec3, Vec3};

/// "No texture" of a slot, "no skin" of a part; the same constants stand in `lib/scene.glsl`.
const NONE: u32 = u32::MAX;
const DOUBLE_SIDED: u32 = 1;
const UNLIT: u32 = 2;
const DIFFUSE_ONLY: u32 = 4;

/// A scene's tables and its world-space vertices.
pub struct World {
    pub vertex_count: u32,
    pub triangle_count: u32,
    /// Global vertex indices, counter-clockwise seen from the front.
    pub triangles: Buffer<UVec3>,
    /// Material index per triangle.
    pub triangle_materials: Buffer<u32>,
    pub attributes: Buffer<VertexAttributes>,
    pub materials: Buffer<Material>,
    pub textures: TextureTable,
    /// World space, metres; one per vertex.
    pub positions: Buffer<Vec3>,
    /// Unit.
    pub normals: Buffer<Vec3>,
    /// xyz unit, w handedness.
    pub tangents: Buffer<[f32; 4]>,
    /// At least one entry is allocated; `light_count` are in use.
    pub lights: Buffer<Light>,
    pub light_count: u32,
    pub environment: WorldEnvironment,
    /// Any material has holes: rays must ask for them.
    pub has_holes: bool,
    local_vertices: Buffer<LocalVertex>,
    vertex_parts: Buffer<u32>,
    parts: Buffer<Part>,
    influences: Buffer<Influence>,
    palette: Buffer<[[f32; 3]; 4]>,
    morph_deltas: Buffer<MorphDelta>,
    morph_weights: Buffer<f32>,
    part_template: Vec<(u32, Part)>,
}

/// The environment's map and sampling tables.
pub struct WorldEnvironment {
    pub info: EnvironmentInfo,
    /// One element: what shaders read.
    pub info_buffer: Buffer<EnvironmentInfo>,
    /// Radiance in RGB; 1 x 1 for a constant.
    pub map: Image,
    pub sampler: Sampler,
    /// Alias table for drawing directions by importance.
    pub cells: Buffer<EnvironmentCell>,
}

impl World {
    /// Uploads everything and places the vertices at `pose`. `diffuse` drops every specular lobe and takes the whole
    /// base colour as albedo (`--diffuse`).
    pub fn new(
        context: &Context,
        scene: &Scene,
        geometry: &Geometry,
        pose: &Pose,
        environment: &Environment,
        diffuse: bool,
    ) -> Result<Self, GpuError> {
        let (vertex_count, triangle_count) = (geometry.vertex_count(), geometry.triangle_count());
        let triangles: Vec<UVec3> = geometry.triangles.iter().map(|&t| t.into()).collect();
        let triangle_materials: Vec<u32> =
            geometry.triangle_part.iter().map(|&part| geometry.parts[part as usize].material).collect();
        let part_template = parts(geometry);
        let materials: Vec<Material> = scene.materials.iter().map(|m| material(m, diffuse)).collect();
        let world = Self {
            vertex_count,
            triangle_count,
            triangles: context.upload("world/triangles", &triangles)?,
            triangle_materials: context.upload("world/triangle materials", &triangle_materials)?,
            attributes: context.upload("world/attributes", &attributes(geometry))?,
            materials: context.upload("world/materials", &materials)?,
            textures: texture_table(context, scene)?,
            positions: context.buffer("world/positions", vertex_count as usize)?,
            normals: context.buffer("world/normals", vertex_count as usize)?,
            tangents: context.buffer("world/tangents", vertex_count as usize)?,
            lights: context.buffer("world/lights", pose.lights.len().max(1))?,
            light_count: pose.lights.len() as u32,
            environment: WorldEnvironment::new(context, environment)?,
            has_holes: materials.iter().any(|m| m.alpha_cutoff >= 0.0),
            local_vertices: context.upload("world/local vertices", &local_vertices(geometry))?,
            vertex_parts: context.upload("world/vertex parts", &geometry.vertex_part)?,
            parts: context.buffer("world/parts", part_template.len())?,
            influences: context.upload("world/influences", &influences(geometry))?,
            palette: context.buffer("world/joint palette", pose.joint_palette.len())?,
            morph_deltas: context.upload("world/morph deltas", &morph_deltas(geometry))?,
            morph_weights: context.buffer("world/morph weights", pose.morph_weights.len())?,
            part_template,
        };
        let mut recorder = context.recorder("world")?;
        world.pose(&mut recorder, pose);
        recorder.submit()?;
        Ok(world)
    }

    /// Takes over the scene's present materials; which of them have holes stays.
    pub fn update_materials(&self, recorder: &mut Recorder<'_>, scene: &Scene, diffuse: bool) {
        let materials: Vec<Material> = scene.materials.iter().map(|m| material(m, diffuse)).collect();
        recorder.write(&self.materials, 0, &materials);
    }

    /// Moves everything to `pose`, which comes from the same scene: transforms and lights are written, vertices
    /// computed.
    pub fn pose(&self, recorder: &mut Recorder<'_>, pose: &Pose) {
        let parts: Vec<Part> = self
            .part_template
            .iter()
            .map(|&(node, part)| {
                let world_from_local = pose.world_from_node[node as usize];
                let linear = Mat3::from_mat4(world_from_local);
                Part {
                    world_from_local: affine(world_from_local),
                    normal_from_local: normal_matrix(linear).to_cols_array_2d(),
                    mirror: if linear.determinant() < 0.0 { -1.0 } else { 1.0 },
                    ..part
                }
            })
            .collect();
        let palette: Vec<_> = pose.joint_palette.iter().map(|&m| affine(m)).collect();
        let lights: Vec<Light> = pose.lights.iter().map(light).collect();
        recorder.write(&self.parts, 0, &parts);
        recorder.write(&self.palette, 0, &palette);
        recorder.write(&self.morph_weights, 0, &pose.morph_weights);
        recorder.write(&self.lights, 0, &lights);
        recorder.dispatch(
            &Deform {
                local_vertices: &self.local_vertices,
                vertex_parts: &self.vertex_parts,
                parts: &self.parts,
                influences: &self.influences,
                palette: &self.palette,
                morph_deltas: &self.morph_deltas,
                morph_weights: &self.morph_weights,
                positions: &self.positions,
                normals: &self.normals,
                tangents: &self.tangents,
                params: DeformParams { vertex_count: self.vertex_count },
            },
            self.vertex_count,
        );
    }
}

impl WorldEnvironment {
    pub fn new(context: &Context, environment: &Environment) -> Result<Self, GpuError> {
        let tables = EnvironmentSampler::new(environment);
        let (info, texels, width, height) = match environment {
            Environment::Constant(radiance) => (
                EnvironmentInfo {
                    constant: *radiance,
                    width: 0,
                    height: 0,
                    rotation: 0.0,
                    cell_columns: 1,
                    cell_rows: 1,
                    cell_extent: 1,
                    is_black: u32::from(environment.is_black()),
                },
                vec![[radiance.x, radiance.y, radiance.z, 1.0]],
                1,
                1,
            ),
            Environment::Map(map) => (
                EnvironmentInfo {
                    constant: Vec3::ZERO,
                    width: map.width,
                    height: map.height,
                    rotation: map.rotation,
                    cell_columns: tables.cell_columns,
                    cell_rows: tables.cell_rows,
                    cell_extent: tables.cell_extent,
                    is_black: u32::from(environment.is_black()),
                },
                map.texels.iter().map(|t| [t.x, t.y, t.z, 1.0]).collect(),
                map.width,
                map.height,
            ),
        };
        let cells = tables.cells.iter();
        let cells: Vec<_> =
            cells.map(|c| EnvironmentCell { threshold: c.threshold, alias: c.alias, density: c.density }).collect();
        let map = context.image(&ImageDescription {
            name: "world/environment",
            width,
            height,
            layers: 1,
            mip_levels: 1,
            format: Format::Rgba32Float,
            shape: Shape::Flat,
        })?;
        let mut recorder = context.recorder("environment")?;
        recorder.write_image(&map, 0, &texels);
        recorder.submit()?;
        Ok(Self {
            info,
            info_buffer: context.upload("world/environment info", &[info])?,
            map,
            sampler: context.sampler("world/environment", SamplerDescription::NEAREST_CLAMP)?,
            cells: context.upload("world/environment cells", &cells)?,
        })
    }
}

/// The upper three rows, column by column.
fn affine(m: Mat4) -> [[f32; 3]; 4] {
    [m.x_axis, m.y_axis, m.z_axis, m.w_axis].map(|column| column.truncate().to_array())
}

fn local_vertices(geometry: &Geometry) -> Vec<LocalVertex> {
    let local = geometry.local_positions.iter().zip(&geometry.local_normals).zip(&geometry.local_tangents);
    local.map(|((&position, &normal), tangent)| LocalVertex { position, normal, tangent: tangent.to_array() }).collect()
}

fn attributes(geometry: &Geometry) -> Vec<VertexAttributes> {
    let attributes = geometry.uv[0].iter().zip(&geometry.uv[1]).zip(&geometry.colors);
    attributes.map(|((&uv0, &uv1), color)| VertexAttributes { uv0, uv1, color: color.to_array() }).collect()
}

fn influences(geometry: &Geometry) -> Vec<Influence> {
    let influences = geometry.skin_joints.iter().zip(&geometry.skin_weights);
    influences.map(|(&joints, &weights)| Influence { joints, weights }).collect()
}

fn morph_deltas(geometry: &Geometry) -> Vec<MorphDelta> {
    let deltas = geometry.morph_positions.iter().zip(&geometry.morph_normals).zip(&geometry.morph_tangents);
    deltas.map(|((&position, &normal), &tangent)| MorphDelta { position, normal, tangent }).collect()
}

/// Each part with its node; transforms are filled in by [`World::pose`].
fn parts(geometry: &Geometry) -> Vec<(u32, Part)> {
    let part = |part: &scene::geometry::Part| {
        let table = Part {
            world_from_local: [[0.0; 3]; 4],
            normal_from_local: [[0.0; 3]; 3],
            mirror: 1.0,
            material: part.material,
            vertex_offset: part.vertex_offset,
            vertex_count: part.vertex_count,
            skin_offset: part.skin_offset.unwrap_or(NONE),
            morph_target_count: part.morph_target_count,
            morph_offset: part.morph_offset,
            morph_weight_offset: part.morph_weight_offset,
        };
        (part.node, table)
    };
    geometry.parts.iter().map(part).collect()
}

fn texture_slot(slot: Option<scene::TextureRef>) -> TextureSlot {
    match slot {
        None => TextureSlot { texture: NONE, uv_set: 0, row_u: Vec3::X, row_v: Vec3::Y },
        Some(slot) => TextureSlot {
            texture: slot.texture,
            uv_set: slot.uv_set,
            row_u: slot.transform[0].into(),
            row_v: slot.transform[1].into(),
        },
    }
}

/// The device form of a material.
pub fn material(m: &scene::Material, diffuse: bool) -> Material {
    let mut flags = 0;
    for (flag, on) in [(DOUBLE_SIDED, m.double_sided), (UNLIT, m.unlit), (DIFFUSE_ONLY, diffuse)] {
        flags |= if on { flag } else { 0 };
    }
    // KHR_materials_ior: F0 = ((ior - 1) / (ior + 1))^2; KHR_materials_specular scales and tints it.
    let f0 = if m.ior == 0.0 { 1.0 } else { ((m.ior - 1.0) / (m.ior + 1.0)).powi(2) };
    Material {
        base_color: m.base_color.to_array(),
        emission: m.emission,
        metallic: if diffuse { 0.0 } else { m.metallic },
        roughness: m.roughness,
        normal_scale: m.normal_scale,
        alpha_cutoff: m.alpha_cutoff.unwrap_or(-1.0),
        flags,
        dielectric_f0: (f0 * m.specular_color).min(Vec3::ONE) * m.specular,
        specular: m.specular,
        base_color_texture: texture_slot(m.base_color_texture),
        metallic_roughness_texture: texture_slot(m.metallic_roughness_texture),
        normal_texture: texture_slot(m.normal_texture),
        emission_texture: texture_slot(m.emission_texture),
    }
}

/// The device form of a light.
pub fn light(light: &PosedLight) -> Light {
    let (kind, scale, offset) = match light.kind {
        LightKind::Point => (0, 0.0, 1.0),
        LightKind::Spot { inner_angle, outer_angle } => {
            // KHR_lights_punctual, "Inner and Outer Cone Angles".
            let (cos_inner, cos_outer) = (inner_angle.cos(), outer_angle.cos());
            let scale = 1.0 / (cos_inner - cos_outer).max(1e-3);
            (1, scale, -cos_outer * scale)
        }
        LightKind::Directional => (2, 0.0, 1.0),
    };
    Light {
        position: light.position,
        kind,
        direction: light.direction,
        range: light.range.unwrap_or(0.0),
        intensity: light.intensity,
        spot_scale: scale,
        spot_offset: offset,
    }
}

/// Uploads images with mip levels and binds every texture of the scene.
fn texture_table(context: &Context, scene: &Scene) -> Result<TextureTable, GpuError> {
    let mut images = Vec::with_capacity(scene.images.len());
    for (index, image) in scene.images.iter().enumerate() {
        let gpu_image = context.image(&ImageDescription {
            name: &format!("textures/{index} {}", image.name),
            width: image.width,
            height: image.height,
            layers: 1,
            mip_levels: image.width.max(image.height).max(1).ilog2() + 1,
            format: if image.srgb { Format::Rgba8Srgb } else { Format::Rgba8 },
            shape: Shape::Flat,
        })?;
        let mut recorder = context.recorder("textures")?;
        let pixels: &[[u8; 4]] = bytemuck::cast_slice(&image.rgba);
        recorder.write_image(&gpu_image, 0, pixels);
        recorder.generate_mips(&gpu_image);
        recorder.submit()?;
        images.push(gpu_image);
    }
    let mut descriptions: Vec<SamplerDescription> = Vec::new();
    let mut textures = Vec::with_capacity(scene.textures.len());
    for texture in &scene.textures {
        let description = sampler_description(texture);
        let sampler = descriptions.iter().position(|d| *d == description).unwrap_or(descriptions.len());
        if sampler == descriptions.len() {
            descriptions.push(description);
        }
        textures.push((texture.image as usize, sampler));
    }
    let samplers: Result<Vec<_>, _> = descriptions.iter().map(|&d| context.sampler("textures/sampler", d)).collect();
    context.texture_table(images, samplers?, &textures)
}

fn sampler_description(texture: &scene::Texture) -> SamplerDescription {
    let address = |wrap| match wrap {
        scene::Wrap::Repeat => AddressMode::Repeat,
        scene::Wrap::MirroredRepeat => AddressMode::MirroredRepeat,
        scene::Wrap::ClampToEdge => AddressMode::ClampToEdge,
    };
    SamplerDescription {
        address: texture.wrap.map(address),
        mag_linear: texture.mag_linear,
        min_linear: texture.min_linear,
        mip_linear: texture.mip_linear,
        mipmapped: texture.mipmapped,
    }
}
