//! The scene at one time: world transforms, joint palette, morph weights, lights and cameras.
//!
//! [`PoseLayout`] says where each skin's joints stand in the palette and each node's morph weights in the weight
//! array; [`super::geometry::Geometry`] stores the same offsets in its parts. Nothing here touches vertices:
//! see [`super::deform`].

use glam::{Mat3, Mat4, Quat, Vec3};

use super::{LightKind, Node, Projection, Scene, Transform};

/// Offsets into [`Pose::joint_palette`] and [`Pose::morph_weights`]; depends on the scene alone, not on the time.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct PoseLayout {
    /// First palette entry of each skin. Instances of a skin share its entries: a skinned vertex ignores its node.
    pub palette_offset: Vec<u32>,
    pub palette_count: u32,
    /// First morph weight of each node and, per node, how many it has (0 for a node that morphs nothing).
    pub weight_offset: Vec<u32>,
    pub weight_count: Vec<u32>,
    pub total_weight_count: u32,
}

impl PoseLayout {
    /// Offsets saturate at `u32::MAX`; [`super::geometry::Geometry::flatten`] refuses a scene that large.
    pub fn of(scene: &Scene) -> Self {
        let mut layout = Self::default();
        for skin in &scene.skins {
            layout.palette_offset.push(layout.palette_count);
            layout.palette_count = layout.palette_count.saturating_add(to_u32(skin.joints.len()));
        }
        for node in &scene.nodes {
            let count = to_u32(morph_target_count(scene, node));
            layout.weight_offset.push(layout.total_weight_count);
            layout.weight_count.push(count);
            layout.total_weight_count = layout.total_weight_count.saturating_add(count);
        }
        layout
    }
}

fn to_u32(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}

/// Morph targets of the node's mesh: the most of any of its primitives.
fn morph_target_count(scene: &Scene, node: &Node) -> usize {
    let mesh = node.mesh.and_then(|mesh| scene.meshes.get(mesh as usize));
    mesh.map_or(0, |mesh| mesh.primitives.iter().map(|p| p.morph_targets.len()).max().unwrap_or(0))
}

/// The scene at one time. Every array is indexed as its field says; sizes depend on the scene alone.
#[derive(Debug, Clone, Default)]
pub struct Pose {
    /// Seconds of animation time; zero at rest.
    pub seconds: f32,
    /// One per node.
    pub world_from_node: Vec<Mat4>,
    /// `world_from_mesh` as each joint moves it, skin after skin ([`PoseLayout::palette_offset`]).
    pub joint_palette: Vec<Mat4>,
    /// Node after node ([`PoseLayout::weight_offset`]).
    pub morph_weights: Vec<f32>,
    /// One per node that carries a light, in node order.
    pub lights: Vec<PosedLight>,
    /// One per node that carries a camera, in node order.
    pub cameras: Vec<PosedCamera>,
}

/// A punctual light in world space.
#[derive(Debug, Clone, PartialEq)]
pub struct PosedLight {
    pub node: u32,
    /// Index in [`Scene::lights`].
    pub light: u32,
    /// Metres.
    pub position: Vec3,
    /// Unit; the way the light shines. Node scale has no effect on a light.
    pub direction: Vec3,
    pub kind: LightKind,
    /// W/sr for point and spot, W/m2 for directional.
    pub intensity: Vec3,
    /// Metres; `None` is unlimited.
    pub range: Option<f32>,
}

/// A camera in world space: it looks along its own -Z with +Y up.
#[derive(Debug, Clone, PartialEq)]
pub struct PosedCamera {
    pub node: u32,
    /// Index in [`Scene::cameras`].
    pub camera: u32,
    pub world_from_camera: Mat4,
    pub projection: Projection,
}

impl Pose {
    /// The scene as the file places it, no clip playing. `Pose::at` (module [`super::animation`]) plays them.
    pub fn rest(scene: &Scene) -> Self {
        let local: Vec<Transform> = scene.nodes.iter().map(|node| node.transform).collect();
        Self::compose(scene, 0.0, &local, rest_weights(scene))
    }

    /// World transforms and everything that follows from them, out of node transforms and morph weights.
    pub(super) fn compose(scene: &Scene, seconds: f32, local: &[Transform], morph_weights: Vec<f32>) -> Self {
        let mut world_from_node: Vec<Mat4> = Vec::with_capacity(scene.nodes.len());
        for (node, transform) in scene.nodes.iter().zip(local) {
            // Parents stand before their children.
            let parent = node.parent.and_then(|parent| world_from_node.get(parent as usize));
            let world_from_parent = parent.copied().unwrap_or(Mat4::IDENTITY);
            world_from_node.push(world_from_parent * transform.matrix());
        }
        let node_matrix = |node: u32| world_from_node.get(node as usize).copied().unwrap_or(Mat4::IDENTITY);
        let mut joint_palette = Vec::new();
        for skin in &scene.skins {
            for (slot, &joint) in skin.joints.iter().enumerate() {
                let joint_from_mesh = skin.inverse_bind.get(slot).copied().unwrap_or(Mat4::IDENTITY);
                joint_palette.push(node_matrix(joint) * joint_from_mesh);
            }
        }
        let (lights, cameras) = (posed_lights(scene, &world_from_node), posed_cameras(scene, &world_from_node));
        Self { seconds, world_from_node, joint_palette, morph_weights, lights, cameras }
    }
}

impl Transform {
    /// `parent_from_node`. Every caller takes node matrices from here, so that all agree bit for bit.
    pub fn matrix(&self) -> Mat4 {
        match *self {
            Self::Trs { translation, rotation, scale } => {
                // A rotation off unit length would scale; a zero one would be no transform at all.
                let rotation = if rotation.length_squared() > 0.0 { rotation.normalize() } else { Quat::IDENTITY };
                Mat4::from_scale_rotation_translation(scale, rotation, translation)
            }
            Self::Matrix(matrix) => matrix,
        }
    }
}

/// Morph weights of every node at rest: the node's own, else its mesh's, else zero.
pub(super) fn rest_weights(scene: &Scene) -> Vec<f32> {
    let mut weights = Vec::new();
    for node in &scene.nodes {
        let mesh = node.mesh.and_then(|mesh| scene.meshes.get(mesh as usize));
        let own = &node.morph_weights;
        let given = if own.is_empty() { mesh.map_or(&[][..], |mesh| &mesh.morph_weights) } else { own };
        let count = morph_target_count(scene, node);
        weights.extend((0..count).map(|target| given.get(target).copied().unwrap_or(0.0)));
    }
    weights
}

fn posed_lights(scene: &Scene, world_from_node: &[Mat4]) -> Vec<PosedLight> {
    let mut lights = Vec::new();
    for (index, (node, world)) in scene.nodes.iter().zip(world_from_node).enumerate() {
        let Some(light) = node.light else { continue };
        let Some(described) = scene.lights.get(light as usize) else { continue };
        lights.push(PosedLight {
            node: index as u32,
            light,
            position: world.w_axis.truncate(),
            direction: axis(*world, Vec3::NEG_Z),
            kind: described.kind,
            intensity: described.intensity,
            range: described.range,
        });
    }
    lights
}

fn posed_cameras(scene: &Scene, world_from_node: &[Mat4]) -> Vec<PosedCamera> {
    let mut cameras = Vec::new();
    for (index, (node, world)) in scene.nodes.iter().zip(world_from_node).enumerate() {
        let Some(camera) = node.camera else { continue };
        let Some(described) = scene.cameras.get(camera as usize) else { continue };
        cameras.push(PosedCamera {
            node: index as u32,
            camera,
            world_from_camera: *world,
            projection: described.projection,
        });
    }
    cameras
}

/// The unit world direction of a node's axis; the axis itself when the node is scaled to nothing.
fn axis(world: Mat4, local: Vec3) -> Vec3 {
    (Mat3::from_mat4(world) * local).try_normalize().unwrap_or(local)
}
