//! The node tree: which nodes the chosen scene holds, parents before children, every reference and number checked.

use super::SceneChoice;
use super::document::Document;
use super::error::{Fault, shown};
use super::json::Object;
use crate::scene::Transform;
use glam::{Mat4, Quat, Vec3, Vec4};

/// The nodes of the chosen scene.
#[derive(Debug)]
pub struct Tree {
    pub scene_name: String,
    /// The file's node indices in our order.
    pub order: Vec<usize>,
    /// Our index of each of the file's nodes, where it has one.
    pub index_of: Vec<Option<u32>>,
    /// The file's parent of each of the file's nodes.
    parents: Vec<Option<usize>>,
    /// This many of `order` belong to the scene itself; the rest only move joints and show nothing.
    pub shown_count: usize,
}

/// Finds the nodes of the scene that `choice` names (the file's default, or else its first, without one), and of all
/// nodes that move the joints of its skins.
pub fn read_tree(document: &Document, choice: Option<&SceneChoice>) -> Result<Tree, Fault> {
    let nodes = document.list("nodes")?;
    let mut children = Vec::with_capacity(nodes.len());
    for node in nodes.objects() {
        children.push(node?.list("children")?.indices("nodes", nodes.len())?);
    }
    let mut parents: Vec<Option<usize>> = vec![None; nodes.len()];
    for (node, children) in children.iter().enumerate() {
        for (position, child) in children.iter().enumerate() {
            // One parent each keeps the graph a forest (or a cycle, found below): no node is ever visited twice.
            if let Some(other) = parents[*child].replace(node) {
                let seen = format!("node {child}, which is a child of node {other} already");
                return Err(Fault::invalid(
                    format!("/nodes/{node}/children/{position}"),
                    "must name a node that has no other parent",
                    seen,
                ));
            }
        }
    }
    check_cycles(&children, &parents)?;

    let (scene_name, roots) = choose_roots(document, choice, &parents)?;
    let mut order = Vec::new();
    let mut index_of = vec![None; nodes.len()];
    let mut stack: Vec<usize> = roots.into_iter().rev().collect();
    while let Some(node) = stack.pop() {
        index_of[node] = Some(order.len() as u32);
        order.push(node);
        stack.extend(children[node].iter().rev());
    }
    let shown_count = order.len();
    let mut tree = Tree { scene_name, order, index_of, parents, shown_count };
    tree.add_joints(document)?;
    Ok(tree)
}

/// With one parent at most for each node, what cannot be reached from a node without parent hangs on a cycle.
fn check_cycles(children: &[Vec<usize>], parents: &[Option<usize>]) -> Result<(), Fault> {
    let mut is_reached = vec![false; parents.len()];
    let mut stack: Vec<usize> = (0..parents.len()).filter(|node| parents[*node].is_none()).collect();
    while let Some(node) = stack.pop() {
        is_reached[node] = true;
        stack.extend(&children[node]);
    }
    match is_reached.iter().position(|reached| !reached) {
        None => Ok(()),
        Some(node) => {
            let pointer = format!("/nodes/{node}");
            Err(Fault::invalid(pointer, "must not be its own ancestor or hang below one that is", "on a cycle"))
        }
    }
}

/// The root nodes of the chosen scene, and its name.
fn choose_roots(
    document: &Document,
    choice: Option<&SceneChoice>,
    parents: &[Option<usize>],
) -> Result<(String, Vec<usize>), Fault> {
    let scenes = document.list("scenes")?;
    let default = document.root.index("scene", "scenes", scenes.len())?;
    let no_such = |wanted| {
        let names: Result<Vec<_>, Fault> = scenes.objects().take(16).map(|scene| Ok(shown(&scene?.name()))).collect();
        let available = match scenes.len() {
            0 => "none".to_owned(),
            count => format!("{count}: {}", names?.join(", ")),
        };
        Err(Fault::NoSuchScene { wanted, available })
    };
    let index = match choice {
        None if scenes.is_empty() => {
            let what = if parents.is_empty() { "it has no nodes either" } else { "all its nodes are shown" };
            document.notes.say(format!("The file has no scene; {what}."));
            return Ok((String::new(), (0..parents.len()).filter(|node| parents[*node].is_none()).collect()));
        }
        None => default.unwrap_or(0),
        Some(SceneChoice::Index(index)) if *index < scenes.len() => *index,
        Some(SceneChoice::Index(index)) => return no_such(index.to_string()),
        Some(SceneChoice::Name(name)) => {
            let mut found = None;
            for (index, scene) in scenes.objects().enumerate() {
                if found.is_none() && scene?.name() == *name {
                    found = Some(index);
                }
            }
            match found {
                Some(index) => index,
                None => return no_such(shown(name)),
            }
        }
    };
    let scene = scenes.object(index)?;
    let list = scene.list("nodes")?;
    let roots = list.indices("nodes", parents.len())?;
    let mut is_root = vec![false; parents.len()];
    for (position, root) in roots.iter().enumerate() {
        if let Some(parent) = parents[*root] {
            let seen = format!("node {root}, a child of node {parent}");
            return Err(Fault::invalid(list.at(position), "must name a node without parent", seen));
        }
        if std::mem::replace(&mut is_root[*root], true) {
            return Err(Fault::invalid(list.at(position), "must not name a node twice", format!("node {root}")));
        }
    }
    Ok((scene.name(), roots))
}

impl Tree {
    /// Our index of the parent of the file's node.
    pub fn parent_of(&self, node: usize) -> Option<u32> {
        self.parents[node].and_then(|parent| self.index_of[parent])
    }

    /// Appends the joints of the skins in use that stand outside the scene, with their ancestors.
    fn add_joints(&mut self, document: &Document) -> Result<(), Fault> {
        let nodes = document.list("nodes")?;
        let skins = document.list("skins")?;
        let mut is_done = vec![false; skins.len()];
        for position in 0..self.shown_count {
            let node = nodes.object(self.order[position])?;
            let Some(skin) = node.index("skin", "skins", skins.len())? else { continue };
            if std::mem::replace(&mut is_done[skin], true) {
                continue;
            }
            for joint in skins.object(skin)?.list("joints")?.indices("nodes", nodes.len())? {
                let mut path = Vec::new();
                let mut next = Some(joint);
                while let Some(node) = next.filter(|node| self.index_of[*node].is_none()) {
                    path.push(node);
                    next = self.parents[node];
                }
                for node in path.into_iter().rev() {
                    self.index_of[node] = Some(self.order.len() as u32);
                    self.order.push(node);
                }
            }
        }
        Ok(())
    }
}

/// Reads where a node stands in its parent.
pub fn read_transform(document: &Document, node: &Object) -> Result<Transform, Fault> {
    if let Some(columns) = node.numbers::<16>("matrix")? {
        if ["translation", "rotation", "scale"].iter().any(|key| node.has(key)) {
            document.notes.say("A node has both a matrix and translation, rotation or scale; the matrix was taken.");
        }
        let matrix = Mat4::from_cols_array(&columns);
        if !matrix.row(3).abs_diff_eq(Vec4::W, 1e-4) {
            let seen = format!("{} at the bottom", matrix.row(3));
            return Err(Fault::invalid(node.at("matrix"), "must be affine, its last row 0 0 0 1", seen));
        }
        return Ok(Transform::Matrix(affine(matrix)));
    }
    let translation = Vec3::from(node.numbers("translation")?.unwrap_or([0.0; 3]));
    let scale = Vec3::from(node.numbers("scale")?.unwrap_or([1.0; 3]));
    let rotation = unit_rotation(node.numbers("rotation")?.unwrap_or([0.0, 0.0, 0.0, 1.0])).unwrap_or_else(|| {
        document.notes.say("A rotation of length zero was taken as no rotation.");
        Quat::IDENTITY
    });
    Ok(Transform::Trs { translation, rotation, scale })
}

/// The quaternion (x, y, z, w) brought to unit length; `None` when it has no direction.
pub fn unit_rotation(rotation: [f32; 4]) -> Option<Quat> {
    // The squares of tiny and huge single-precision numbers leave their range; in double precision they do not.
    let [x, y, z, w] = rotation.map(f64::from);
    let length = (x * x + y * y + z * z + w * w).sqrt();
    (length > 0.0).then(|| Quat::from_array([x, y, z, w].map(|value| (value / length) as f32)))
}

/// The matrix with the last row that every affine one has.
pub fn affine(mut matrix: Mat4) -> Mat4 {
    (matrix.x_axis.w, matrix.y_axis.w, matrix.z_axis.w, matrix.w_axis.w) = (0.0, 0.0, 0.0, 1.0);
    matrix
}
