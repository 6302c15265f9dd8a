//! Cluster trees kept between runs: one file per mesh, named by what it was made of.
//!
//! A file holds a header, the table and its hash; it is written aside and renamed. What is damaged, of another version
//! or cannot be read is as good as not there: the tree is built again. Files not used for longest make room for new ones
//! ([`kept`]).

use super::{ClusterTree, MAX_DEPTH, MeshFaces, face_count, first_face};
use crate::files;
use crate::gpu::shaders::types::FaceCluster;
use crate::stages::kept;
use std::io::Write;
use std::path::{Path, PathBuf};

/// To be raised whenever trees of the same mesh come out different.
const VERSION: u32 = 3;
const MAGIC: [u8; 8] = *b"LLclustr";
/// Meshes of fewer faces are clustered faster than read.
pub const LEAST_FACES: usize = 4096;

/// Magic, version, depth, clusters, faces.
const HEADER: usize = 8 + 4 * 4;
const HASH: usize = 32;

/// All that decides the tree of a mesh.
pub fn key(mesh: &MeshFaces<'_>) -> blake3::Hash {
    let mut hash = blake3::Hasher::new();
    hash.update(&VERSION.to_le_bytes());
    for length in [mesh.positions.len(), mesh.triangles.len()] {
        hash.update(&(length as u64).to_le_bytes());
    }
    hash.update(bytemuck::cast_slice(mesh.positions));
    hash.update(bytemuck::cast_slice(mesh.triangles));
    for values in [mesh.albedo, mesh.reflectance, mesh.emission] {
        hash.update(bytemuck::cast_slice(values));
    }
    hash.finalize()
}

/// The tree of `mesh` from `folder`, or built and put there. Without a folder, or where it cannot be written, only built.
pub fn tree(mesh: &MeshFaces<'_>, folder: Option<&Path>) -> ClusterTree {
    let Some(folder) = folder.filter(|_| mesh.triangles.len() >= LEAST_FACES) else {
        return ClusterTree::build(mesh);
    };
    let path = path_of(folder, mesh);
    if let Some(tree) = files::read(&path).ok().and_then(|bytes| decode(&bytes, mesh.triangles.len())) {
        kept::used(&path);
        return tree;
    }
    let tree = ClusterTree::build(mesh);
    if let Err(error) = write(folder, &path, &tree) {
        tracing::debug!("cannot keep clusters in {}: {error}", path.display());
    }
    tree
}

/// Where the tree of `mesh` is kept.
pub fn path_of(folder: &Path, mesh: &MeshFaces<'_>) -> PathBuf {
    folder.join(format!("{}.clusters", key(mesh).to_hex()))
}

fn write(folder: &Path, path: &Path, tree: &ClusterTree) -> std::io::Result<()> {
    files::create_dir_all(folder)?;
    let mut part = files::Part::create(&tempfile::Builder::new(), path)?;
    part.write_all(&encode(tree))?;
    part.finish()?;
    kept::make_room(folder, ["", ".clusters"], path, kept::MOST_BYTES);
    Ok(())
}

/// The content of a file.
pub fn encode(tree: &ClusterTree) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEADER + tree.size_bytes() as usize + HASH);
    bytes.extend(MAGIC);
    for number in [VERSION, tree.depth, tree.clusters.len() as u32, tree.faces.len() as u32] {
        bytes.extend(number.to_le_bytes());
    }
    bytes.extend(bytemuck::cast_slice::<FaceCluster, u8>(&tree.clusters));
    bytes.extend(bytemuck::cast_slice::<u32, u8>(&tree.faces));
    let hash = blake3::hash(&bytes);
    bytes.extend(hash.as_bytes());
    bytes
}

/// `None` for anything but a whole and sound tree of `face_count` faces.
pub fn decode(bytes: &[u8], face_count: usize) -> Option<ClusterTree> {
    let (body, hash) = bytes.split_last_chunk::<HASH>()?;
    let (magic, rest) = body.split_first_chunk::<8>()?;
    if *magic != MAGIC || blake3::hash(body).as_bytes() != hash || rest.len() < HEADER - 8 {
        return None;
    }
    let (numbers, tables) = rest.split_at(HEADER - 8);
    let number = |k: usize| Some(u32::from_le_bytes(numbers.get(4 * k..4 * k + 4)?.try_into().ok()?));
    let (version, depth, clusters, faces) = (number(0)?, number(1)?, number(2)? as usize, number(3)? as usize);
    let cluster_bytes = clusters.checked_mul(size_of::<FaceCluster>())?;
    let is_whole = version == VERSION
        && faces == face_count
        && faces > 0
        && clusters == faces.checked_mul(2)? - 1
        && tables.len() == cluster_bytes + faces.checked_mul(4)?;
    if !is_whole {
        return None;
    }
    let (clusters, faces) = tables.split_at(cluster_bytes);
    let tree = ClusterTree {
        clusters: bytemuck::pod_collect_to_vec(clusters),
        faces: bytemuck::pod_collect_to_vec(faces),
        depth,
    };
    is_sound(&tree).then_some(tree)
}

/// What walks trust: the faces of a cluster are those of its two children, no deeper than stated, each face once.
fn is_sound(tree: &ClusterTree) -> bool {
    // A cluster with the levels above it, its first face and number of faces, as its parent has it.
    let mut expected = vec![(0, 0, 0, tree.faces.len() as u32)];
    let mut next = 0;
    while let Some((cluster, level, first, count)) = expected.pop() {
        let here = &tree.clusters[cluster as usize];
        if cluster != next
            || (first_face(here), face_count(here)) != (first, count)
            || level > tree.depth.min(MAX_DEPTH)
        {
            return false;
        }
        next += 1;
        if count > 1 {
            let left = tree.clusters.get(cluster as usize + 1).map_or(0, face_count);
            if left == 0 || left >= count {
                return false;
            }
            expected.push((cluster + 2 * left, level + 1, first + left, count - left));
            expected.push((cluster + 1, level + 1, first, left));
        }
    }
    let mut is_there = vec![false; tree.faces.len()];
    tree.faces.iter().all(|face| is_there.get_mut(*face as usize).is_some_and(|there| !std::mem::replace(there, true)))
}
