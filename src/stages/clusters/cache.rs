//! Cluster trees kept between runs: one file per mesh, named by what it was made of.
//!
//! A file holds a header, the table and its hash; it is written aside and renamed. What is damaged, of another version
//! or cannot be read is as good as not there: the tree is built again. Files not used for longest make room for new ones
//! ([`kept`]).

use super::{ClusterTree, MeshFaces};
use crate::gpu::shaders::types::FaceCluster;
use crate::stages::kept;
use std::io::Write;
use std::path::{Path, PathBuf};

/// To be raised whenever trees of the same mesh come out different.
const VERSION: u32 = 1;
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
    if let Some(tree) = std::fs::read(&path).ok().and_then(|bytes| decode(&bytes, mesh.triangles.len())) {
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
    std::fs::create_dir_all(folder)?;
    let mut file = tempfile::NamedTempFile::new_in(folder)?;
    file.write_all(&encode(tree))?;
    file.persist(path)?;
    kept::make_room(folder, ["", ".clusters"], path, kept::MOST_BYTES);
    Ok(())
}

fn encode(tree: &ClusterTree) -> Vec<u8> {
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

/// `None` for anything but a whole tree of `face_count` faces.
fn decode(bytes: &[u8], face_count: usize) -> Option<ClusterTree> {
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
        && clusters == 2 * faces - 1
        && tables.len() == cluster_bytes + faces.checked_mul(4)?;
    is_whole.then(|| {
        let (clusters, faces) = tables.split_at(cluster_bytes);
        ClusterTree {
            clusters: bytemuck::pod_collect_to_vec(clusters),
            faces: bytemuck::pod_collect_to_vec(faces),
            depth,
        }
    })
}
