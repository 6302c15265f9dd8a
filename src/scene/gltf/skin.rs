//! Skins: which nodes are joints, and their inverse bind matrices.

use super::accessor::{Accessor, Component, Selection};
use super::document::Document;
use super::error::Fault;
use super::json::Object;
use super::node::{Tree, affine};
use crate::scene::Skin;
use glam::{Mat4, Vec4};

/// Reads one skin, all joints of which are in `tree`.
pub fn read(document: &Document, object: &Object, tree: &Tree) -> Result<Skin, Fault> {
    let list = object.list("joints")?;
    let file_joints = list.indices("nodes", tree.index_of.len())?;
    if file_joints.is_empty() {
        return Err(Fault::invalid(object.at("joints"), "must name at least one node", "absent or empty"));
    }
    let mut joints = Vec::with_capacity(file_joints.len());
    for (position, node) in file_joints.iter().enumerate() {
        let joint = tree.index_of[*node];
        joints.push(joint.ok_or_else(|| Fault::invalid(list.at(position), "must be a node of the scene", node))?);
    }
    let inverse_bind = match Accessor::open(document, object, "inverseBindMatrices")? {
        None => {
            document.budget.reserve_array::<Mat4>(joints.len() as u64, || "inverse bind matrices".into())?;
            vec![Mat4::IDENTITY; joints.len()]
        }
        Some(accessor) => {
            accessor.expect("inverseBindMatrices", &["MAT4"], &[(Component::F32, false)])?;
            if accessor.count < joints.len() {
                let rule = format!("must cover the {} joints of {}", joints.len(), object.pointer());
                return Err(Fault::invalid(format!("{}/count", accessor.pointer), rule, accessor.count));
            }
            let mut matrices = accessor.read(document, Selection::All, |columns| Mat4::from_cols_array(&columns))?;
            matrices.truncate(joints.len());
            for matrix in &mut matrices {
                if !matrix.row(3).abs_diff_eq(Vec4::W, 1e-4) {
                    document.notes.say("The last row of an inverse bind matrix was taken as 0 0 0 1, as glTF asks.");
                }
                *matrix = affine(*matrix);
            }
            matrices
        }
    };
    Ok(Skin { joints, inverse_bind })
}
