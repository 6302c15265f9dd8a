//! Plain scene data: what a glTF file says, in our own types, and nothing of the GPU.
//!
//! [`Scene`] is the file as a person thinks of it (node tree, meshes, materials, lights, cameras, clips). A
//! [`pose::Pose`] is the scene at one time. [`geometry::Geometry`] is the scene flattened for the stages: one vertex per finite
//! element, triangles with global indices, one [`geometry::Part`] per drawn (node, primitive) pair.
//!
//! Conventions (glTF's own): right-handed, Y up, metres, radians, linear Rec. 709 RGB; punctual intensities are
//! taken one to one as W/sr (point, spot) and W/m2 (directional).

pub mod adjacency;
pub mod alias;
pub mod animation;
pub mod atlas;
pub mod builtin;
pub mod calipers;
pub mod camera;
pub mod charts;
pub mod deform;
pub mod environment;
pub mod facets;
pub mod geometry;
pub mod gltf;
pub mod patches;
pub mod pose;
pub mod rigid;
pub mod shapes;
pub mod surfaces;
pub mod tessellate;

pub use builtin::{OpenError, open};
pub use gltf::{LoadOptions, SceneChoice, SceneError, load, load_bytes, load_bytes_with};

use glam::{Mat4, Quat, Vec2, Vec3, Vec4};

/// A loaded scene. Every index stored in it is in range and every number in it is finite.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    pub name: String,
    /// Parents stand before their children.
    pub nodes: Vec<Node>,
    pub meshes: Vec<Mesh>,
    /// Never empty: a primitive without a material refers to an appended default one.
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    pub images: Vec<Image>,
    pub skins: Vec<Skin>,
    pub clips: Vec<Clip>,
    pub cameras: Vec<Camera>,
    pub lights: Vec<Light>,
    /// What was skipped, approximated or repaired while loading, each said once, in whole sentences.
    pub notes: Vec<String>,
}

impl Scene {
    /// Bytes of its pictures and tables, which is nearly all that it takes.
    pub fn size_bytes(&self) -> u64 {
        let images = self.images.iter().map(|image| image.rgba.len());
        let primitives = self.meshes.iter().flat_map(|mesh| &mesh.primitives).map(Primitive::size_bytes);
        let clips = self.clips.iter().flat_map(|clip| &clip.channels).map(|channel| channel.times.len() * 20);
        let nodes = self.nodes.len() * size_of::<Node>();
        images.chain(primitives).chain(clips).chain([nodes]).fold(0, |sum: u64, bytes| sum.saturating_add(bytes as u64))
    }
}

#[derive(Debug, Clone, Default)]
pub struct Node {
    pub name: String,
    pub parent: Option<u32>,
    pub transform: Transform,
    pub mesh: Option<u32>,
    pub skin: Option<u32>,
    pub camera: Option<u32>,
    pub light: Option<u32>,
    /// Morph weights at rest; empty takes the mesh's own.
    pub morph_weights: Vec<f32>,
}

/// A node's place in its parent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Transform {
    Trs { translation: Vec3, rotation: Quat, scale: Vec3 },
    Matrix(Mat4),
}

impl Default for Transform {
    fn default() -> Self {
        Self::Trs { translation: Vec3::ZERO, rotation: Quat::IDENTITY, scale: Vec3::ONE }
    }
}

#[derive(Debug, Clone, Default)]
pub struct Mesh {
    pub name: String,
    pub primitives: Vec<Primitive>,
    /// Default morph weights, one per target (all primitives of a mesh have the same targets).
    pub morph_weights: Vec<f32>,
}

/// Triangles with one material. Attribute arrays are empty where absent, else of `positions.len()`.
#[derive(Debug, Clone, Default)]
pub struct Primitive {
    pub positions: Vec<Vec3>,
    /// Unit length; computed (flat or smooth as glTF asks) where the file has none.
    pub normals: Vec<Vec3>,
    /// xyz unit tangent, w = +1 or -1 handedness; present when the material has a normal map and the
    /// primitive the texture coordinates it needs.
    pub tangents: Vec<Vec4>,
    pub uv: [Vec<Vec2>; 2],
    /// Linear RGBA vertex colour.
    pub colors: Vec<Vec4>,
    /// Up to eight influences a vertex (JOINTS_0, JOINTS_1); weights sum to one.
    pub joints: Vec<[u16; 8]>,
    pub joint_weights: Vec<[f32; 8]>,
    pub morph_targets: Vec<MorphTarget>,
    pub triangles: Vec<[u32; 3]>,
    pub material: u32,
}

impl Primitive {
    fn size_bytes(&self) -> usize {
        let targets = self.morph_targets.iter();
        let deltas: usize = targets.map(|t| t.positions.len() + t.normals.len() + t.tangents.len()).sum();
        size_of::<Vec3>() * (self.positions.len() + self.normals.len() + deltas + self.triangles.len())
            + size_of::<Vec2>() * (self.uv[0].len() + self.uv[1].len())
            + size_of::<Vec4>() * (self.tangents.len() + self.colors.len() + self.joints.len())
            + size_of::<[f32; 8]>() * self.joint_weights.len()
    }
}

/// Displacements per vertex; empty where the target does not move that attribute.
#[derive(Debug, Clone, Default)]
pub struct MorphTarget {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub tangents: Vec<Vec3>,
}

#[derive(Debug, Clone)]
pub struct Material {
    pub name: String,
    /// Linear RGBA.
    pub base_color: Vec4,
    pub base_color_texture: Option<TextureRef>,
    pub metallic: f32,
    pub roughness: f32,
    /// G = roughness, B = metallic.
    pub metallic_roughness_texture: Option<TextureRef>,
    pub normal_texture: Option<TextureRef>,
    pub normal_scale: f32,
    /// R = occlusion; kept for completeness, no method uses it (occlusion is what they compute).
    pub occlusion_texture: Option<TextureRef>,
    pub occlusion_strength: f32,
    /// Emitted radiance, W m^-2 sr^-1, emissive strength included.
    pub emission: Vec3,
    pub emission_texture: Option<TextureRef>,
    /// Alpha below this is a hole (masked and blended materials); `None` is opaque.
    pub alpha_cutoff: Option<f32>,
    pub double_sided: bool,
    /// KHR_materials_unlit: shown as base colour, takes no part in light transport but blocks light.
    pub unlit: bool,
    /// KHR_materials_ior: index of refraction (default 1.5 gives F0 = 0.04).
    pub ior: f32,
    /// KHR_materials_specular: factor and colour of the dielectric specular lobe.
    pub specular: f32,
    pub specular_color: Vec3,
}

/// glTF's defaults: white, fully metallic and rough, opaque, one-sided.
impl Default for Material {
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: Vec4::ONE,
            base_color_texture: None,
            metallic: 1.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            occlusion_texture: None,
            occlusion_strength: 1.0,
            emission: Vec3::ZERO,
            emission_texture: None,
            alpha_cutoff: None,
            double_sided: false,
            unlit: false,
            ior: 1.5,
            specular: 1.0,
            specular_color: Vec3::ONE,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TextureRef {
    pub texture: u32,
    /// Which UV set, 0 or 1.
    pub uv_set: u32,
    /// KHR_texture_transform as rows of a 2x3 matrix: uv' = M * (u, v, 1).
    pub transform: [[f32; 3]; 2],
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Texture {
    pub image: u32,
    pub wrap: [Wrap; 2],
    pub mag_linear: bool,
    pub min_linear: bool,
    /// Mip levels are used, and blended when `mip_linear`.
    pub mipmapped: bool,
    pub mip_linear: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Wrap {
    #[default]
    Repeat,
    MirroredRepeat,
    ClampToEdge,
}

/// Most pixels on a side of an [`Image`]: what desktop GPUs and lavapipe can sample.
pub const MAX_IMAGE_EXTENT: u32 = 16384;

/// Eight-bit RGBA, row 0 at the top, at most [`MAX_IMAGE_EXTENT`] a side.
#[derive(Debug, Clone, Default)]
pub struct Image {
    pub name: String,
    pub width: u32,
    pub height: u32,
    /// `width * height * 4` bytes.
    pub rgba: Vec<u8>,
    /// Colour data (base colour, emission) is sRGB-encoded; everything else is linear.
    pub srgb: bool,
}

#[derive(Debug, Clone, Default)]
pub struct Skin {
    /// Node indices.
    pub joints: Vec<u32>,
    /// `joint_from_mesh` at bind time, one per joint.
    pub inverse_bind: Vec<Mat4>,
}

/// One animation of the file.
#[derive(Debug, Clone, Default)]
pub struct Clip {
    pub name: String,
    /// Seconds; the clip loops.
    pub duration: f32,
    pub channels: Vec<Channel>,
}

#[derive(Debug, Clone)]
pub struct Channel {
    pub node: u32,
    pub interpolation: Interpolation,
    /// Strictly increasing seconds.
    pub times: Vec<f32>,
    pub track: Track,
}

/// Values per key; CUBICSPLINE holds (in-tangent, value, out-tangent) triples.
#[derive(Debug, Clone)]
pub enum Track {
    Translation(Vec<Vec3>),
    Rotation(Vec<Quat>),
    Scale(Vec<Vec3>),
    /// `target_count` weights per key (times three for CUBICSPLINE), flattened.
    MorphWeights {
        target_count: usize,
        weights: Vec<f32>,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolation {
    Step,
    Linear,
    CubicSpline,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    pub name: String,
    pub projection: Projection,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// Vertical field of view in radians.
    Perspective { fov_y: f32, near: f32, far: Option<f32> },
    /// Half extents in metres.
    Orthographic { half_width: f32, half_height: f32, near: f32, far: f32 },
}

/// KHR_lights_punctual. Shines along the node's -Z from its origin.
#[derive(Debug, Clone, PartialEq)]
pub struct Light {
    pub name: String,
    pub kind: LightKind,
    /// colour x intensity: W/sr for point and spot, W/m2 for directional.
    pub intensity: Vec3,
    /// Metres; beyond it the light is cut off (smoothly, as the extension says); `None` is unlimited.
    pub range: Option<f32>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LightKind {
    Point,
    Directional,
    /// Half angles in radians.
    Spot {
        inner_angle: f32,
        outer_angle: f32,
    },
}
