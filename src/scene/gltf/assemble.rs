//! The order in which a scene is read: nodes, then what they use, each once, in the order of the file.

use super::SceneChoice;
use super::document::Document;
use super::error::Fault;
use super::json::{List, Object};
use super::mesh::{self, Repairs, Wanted};
use super::node::{self, Tree};
use super::texture::Textures;
use super::{animation, camera, light, material, skin};
use crate::scene::{Material, Mesh, Node, Scene, Transform};
use glam::{Quat, Vec3};

/// Reads the chosen scene and all that it uses.
pub fn scene(document: &Document, choice: Option<&SceneChoice>) -> Result<Scene, Fault> {
    let tree = node::read_tree(document, choice)?;
    let objects = tree.order.iter().map(|node| document.list("nodes")?.object(*node)).collect::<Result<Vec<_>, _>>()?;
    let shown = &objects[..tree.shown_count];
    let lists = Lists::new(document)?;
    let mut scene = Scene { name: tree.scene_name.clone(), ..Scene::default() };

    let mut meshes = InUse::new(lists.meshes.len());
    let mut cameras = InUse::new(lists.cameras.len());
    let mut lights = InUse::new(lists.lights.len());
    let mut skins = InUse::new(lists.skins.len());
    for node in shown {
        let mesh = node.index("mesh", "meshes", lists.meshes.len())?;
        meshes.mark(mesh);
        cameras.mark(node.index("camera", "cameras", lists.cameras.len())?);
        lights.mark(light::of_node(node, &lists.lights)?);
        let skin = node.index("skin", "skins", lists.skins.len())?;
        skins.mark(skin.filter(|_| mesh.is_some()));
    }

    let materials = read_materials(document, &lists, &meshes, &mut scene)?;
    let mut repairs = Repairs::default();
    scene.meshes = meshes.read(|index| {
        let wanted = |primitive: &Object| {
            let file_material = primitive.index("material", "materials", lists.materials.len())?;
            Ok(Wanted::new(materials.of(file_material), &scene.materials))
        };
        mesh::read(document, &lists.meshes.object(index)?, wanted, &mut repairs).map(Some)
    })?;
    repairs.note(document);
    scene.cameras = cameras.read(|index| camera::read(document, &lists.cameras.object(index)?))?;
    scene.lights = lights.read(|index| light::read(document, &lists.lights.object(index)?))?;
    scene.skins = skins.read(|index| skin::read(document, &lists.skins.object(index)?, &tree).map(Some))?;

    for (object, file_node) in objects.iter().zip(&tree.order) {
        scene.nodes.push(Node {
            name: object.name(),
            parent: tree.parent_of(*file_node),
            transform: node::read_transform(document, object)?,
            ..Node::default()
        });
    }
    let joints = |mesh: &Mesh| mesh.primitives.iter().flat_map(|primitive| &primitive.joints).flatten().max().copied();
    let largest_joint: Vec<Option<u16>> = scene.meshes.iter().map(joints).collect();
    for (index, object) in shown.iter().enumerate() {
        scene.nodes[index].mesh = meshes.of(object.index("mesh", "meshes", lists.meshes.len())?);
        scene.nodes[index].camera = cameras.of(object.index("camera", "cameras", lists.cameras.len())?);
        scene.nodes[index].light = lights.of(light::of_node(object, &lists.lights)?);
        let skin = skins.of(object.index("skin", "skins", lists.skins.len())?);
        bind_skin(document, &mut scene, index, &largest_joint, skin, object)?;
        read_morph_weights(&mut scene, index, object)?;
    }
    read_clips(document, &mut scene, &tree)?;
    Ok(scene)
}

/// The root collections that nodes refer to.
struct Lists<'a> {
    meshes: List<'a>,
    materials: List<'a>,
    cameras: List<'a>,
    lights: List<'a>,
    skins: List<'a>,
}

impl<'a> Lists<'a> {
    fn new(document: &Document<'a>) -> Result<Self, Fault> {
        Ok(Self {
            meshes: document.list("meshes")?,
            materials: document.list("materials")?,
            cameras: document.list("cameras")?,
            lights: light::list(document)?,
            skins: document.list("skins")?,
        })
    }
}

/// Which entries of one of the file's collections are used, and our index of each that was read.
struct InUse {
    is_used: Vec<bool>,
    index_of: Vec<Option<u32>>,
}

impl InUse {
    fn new(count: usize) -> Self {
        Self { is_used: vec![false; count], index_of: vec![None; count] }
    }

    fn mark(&mut self, index: Option<usize>) {
        if let Some(index) = index {
            self.is_used[index] = true;
        }
    }

    /// Reads the used entries in the file's order. `None` leaves one out.
    fn read<T>(&mut self, mut read: impl FnMut(usize) -> Result<Option<T>, Fault>) -> Result<Vec<T>, Fault> {
        let mut values = Vec::new();
        for index in (0..self.is_used.len()).filter(|index| self.is_used[*index]) {
            if let Some(value) = read(index)? {
                self.index_of[index] = Some(values.len() as u32);
                values.push(value);
            }
        }
        Ok(values)
    }

    fn of(&self, index: Option<usize>) -> Option<u32> {
        index.and_then(|index| self.index_of[index])
    }
}

/// Our material of each of the file's, and of primitives that name none.
struct MaterialMap {
    named: InUse,
    default: u32,
}

impl MaterialMap {
    fn of(&self, index: Option<usize>) -> u32 {
        self.named.of(index).unwrap_or(self.default)
    }
}

/// Reads the materials of the meshes in use, with their textures. The default material is appended when needed.
fn read_materials(document: &Document, lists: &Lists, meshes: &InUse, scene: &mut Scene) -> Result<MaterialMap, Fault> {
    let mut named = InUse::new(lists.materials.len());
    let mut needs_default = false;
    for mesh in (0..lists.meshes.len()).filter(|mesh| meshes.is_used[*mesh]) {
        for primitive in lists.meshes.object(mesh)?.list("primitives")?.objects() {
            let material = primitive?.index("material", "materials", lists.materials.len())?;
            named.mark(material);
            needs_default |= material.is_none();
        }
    }
    let mut textures = Textures::default();
    scene.materials =
        named.read(|index| material::read(document, &lists.materials.object(index)?, &mut textures).map(Some))?;
    let default = scene.materials.len() as u32;
    if needs_default || scene.materials.is_empty() {
        scene.materials.push(Material { name: "default".into(), ..Material::default() });
    }
    (scene.textures, scene.images) = textures.finish(document, &mut scene.materials)?;
    Ok(MaterialMap { named, default })
}

/// Gives a node its skin, when its mesh (whose largest joint is `largest_joint`) has joints and the skin has them all.
fn bind_skin(
    document: &Document,
    scene: &mut Scene,
    node: usize,
    largest_joint: &[Option<u16>],
    skin: Option<u32>,
    object: &Object,
) -> Result<(), Fault> {
    let (Some(skin), Some(mesh)) = (skin, scene.nodes[node].mesh) else { return Ok(()) };
    let Some(largest) = largest_joint[mesh as usize] else {
        document.notes.say("A skin has no effect on a mesh without joints and weights.");
        return Ok(());
    };
    let joint_count = scene.skins[skin as usize].joints.len();
    if usize::from(largest) >= joint_count {
        let rule = format!("must have a joint for each that its mesh names (up to {largest})");
        return Err(Fault::invalid(object.at("skin"), rule, format!("a skin of {joint_count} joints")));
    }
    scene.nodes[node].skin = Some(skin);
    Ok(())
}

fn read_morph_weights(scene: &mut Scene, node: usize, object: &Object) -> Result<(), Fault> {
    let weights = object.list("weights")?.numbers()?;
    let Some(mesh) = scene.nodes[node].mesh else { return Ok(()) };
    let target_count = scene.meshes[mesh as usize].morph_weights.len();
    if !weights.is_empty() && weights.len() != target_count {
        let rule = format!("must hold a weight for each of the mesh's {target_count} morph targets");
        return Err(Fault::invalid(object.at("weights"), rule, weights.len()));
    }
    scene.nodes[node].morph_weights = weights;
    Ok(())
}

fn read_clips(document: &Document, scene: &mut Scene, tree: &Tree) -> Result<(), Fault> {
    let target_count = |file_node: usize| {
        let mesh = tree.index_of[file_node].and_then(|node| scene.nodes[node as usize].mesh);
        mesh.map_or(0, |mesh| scene.meshes[mesh as usize].morph_weights.len())
    };
    let mut clips = Vec::new();
    for animation in document.list("animations")?.objects() {
        clips.extend(animation::read(document, &animation?, tree, target_count)?);
    }
    for channel in clips.iter().flat_map(|clip| &clip.channels) {
        let transform = &mut scene.nodes[channel.node as usize].transform;
        if let Transform::Matrix(matrix) = *transform {
            document.notes.say("The matrix of an animated node was split into translation, rotation and scale.");
            let (scale, rotation, translation) = matrix.to_scale_rotation_translation();
            // That of a sheared matrix is none yet.
            let rotation = rotation.normalize();
            let is_sound = scale.is_finite() && rotation.is_normalized() && translation.is_finite();
            *transform = match is_sound {
                true => Transform::Trs { translation, rotation, scale },
                false => Transform::Trs { translation, rotation: Quat::IDENTITY, scale: Vec3::ZERO },
            };
        }
    }
    scene.clips = clips;
    Ok(())
}
