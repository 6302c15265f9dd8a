//! Face clusters: a binary tree over the faces of one mesh, every node a compact, nearly flat piece of surface with
//! its bounds.                                                                 [Gobbetti2003 3.1; Garland2001]
//!
//! | module | what it does |
//! |---|---|
//! | [`contract`] | joins faces pairwise, the cheapest pair first: which clusters there are |
//! | [`forest`] | orders them: preorder, every cluster's faces one range, depth bounded |
//! | [`cache`] | keeps trees between runs |
//! | [`measure`] | what each is like: oriented box, areas, spread of attributes |
//! | [`self_transfer`] | what of a cluster's light meets itself |
//!
//! A tree belongs to a mesh; instances share it. The left child of cluster `i` is `i + 1`, the right one follows the
//! left one's `2 n - 1` clusters, and a cluster of one face is a leaf: no indices are stored.
//!
//! [Gobbetti2003]: crate::methods::PAPERS
//! [Garland2001]: crate::methods::PAPERS

pub mod cache;
pub mod contract;
pub mod forest;
pub mod measure;
pub mod self_transfer;

use crate::gpu::shaders::types::FaceCluster;
use glam::{Mat3, Quat, Vec3, Vec4};

/// Lower bits of [`FaceCluster::face_count`] and [`FaceCluster::first_face`]; the upper four hold [`self_shares`].
pub const INDEX_BITS: u32 = 28;

/// Levels of a tree, at most.
pub const MAX_DEPTH: u32 = 96;

/// What a mesh is to be clustered by.
#[derive(Debug, Clone, Copy)]
pub struct MeshFaces<'a> {
    /// Metres, in the space the tree is to be in.
    pub positions: &'a [Vec3],
    /// Indices into `positions`, counter-clockwise from the front.
    pub triangles: &'a [[u32; 3]],
    /// Diffuse reflectance, one per triangle.
    pub albedo: &'a [Vec3],
    /// All that is reflected, one per triangle: bounds what a change of irradiance shows.
    pub reflectance: &'a [Vec3],
    /// Emitted radiance, one per triangle, W m^-2 sr^-1.
    pub emission: &'a [Vec3],
}

/// The clusters of a mesh.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ClusterTree {
    /// Preorder, `2 face_count - 1`; the root first.
    pub clusters: Vec<FaceCluster>,
    /// Triangle at each place; a cluster's are at `first_face .. first_face + face_count`.
    pub faces: Vec<u32>,
    /// Levels below the root.
    pub depth: u32,
}

impl ClusterTree {
    /// Clusters the faces on all cores; the same input gives the same tree.
    pub fn build(mesh: &MeshFaces<'_>) -> Self {
        if mesh.triangles.is_empty() {
            return Self::default();
        }
        let merges = contract::contract(mesh);
        let forest = forest::Forest::new(mesh, &merges);
        let clusters = measure::measure(mesh, &forest);
        Self { clusters, faces: forest.faces, depth: forest.depth }
    }

    /// Left and right child; `None` for a leaf.
    pub fn children(&self, cluster: u32) -> Option<[u32; 2]> {
        let count = face_count(&self.clusters[cluster as usize]);
        (count > 1).then(|| {
            let left = cluster + 1;
            [left, left + 2 * face_count(&self.clusters[left as usize]) - 1]
        })
    }

    /// The tree and its face order.
    pub fn size_bytes(&self) -> u64 {
        (size_of_val(&self.clusters[..]) + size_of_val(&self.faces[..])) as u64
    }
}

/// Faces of the cluster.
pub fn face_count(cluster: &FaceCluster) -> u32 {
    cluster.face_count & ((1 << INDEX_BITS) - 1)
}

/// Place of the cluster's first face.
pub fn first_face(cluster: &FaceCluster) -> u32 {
    cluster.first_face & ((1 << INDEX_BITS) - 1)
}

/// Of what the faces' fronts and their backs send beyond their vector area, the shares that meet the cluster itself if
/// nothing stands between: 0 where none sees another.                                     [Gobbetti2003 3.3.3]
pub fn self_shares(cluster: &FaceCluster) -> [f32; 2] {
    [cluster.face_count, cluster.first_face].map(|word| match word >> INDEX_BITS {
        0 => 0.0,
        level => (0.5 * (level as f32 - 15.0)).exp2(),
    })
}

/// The box's axes; z along the area-averaged normal.
pub fn axes(cluster: &FaceCluster) -> Mat3 {
    Mat3::from_quat(Quat::from_vec4(Vec4::from_array(cluster.rotation)))
}

/// Normal-projected area, m2: |sum of A n|, the faces' vector area.                       [Gobbetti2003 3.1]
pub fn normal_projected_area(cluster: &FaceCluster) -> f32 {
    cluster.facing[4] - cluster.facing[5]
}

/// Upper bound of the projected area towards `direction` (unit), m2.                        [Gobbetti2003 3.1]
pub fn most_projected_area(cluster: &FaceCluster, direction: Vec3) -> f32 {
    let along = axes(cluster).transpose() * direction;
    let sides =
        (0..3).map(|k| (along[k] * cluster.facing[2 * k]).max(0.0) + (-along[k] * cluster.facing[2 * k + 1]).max(0.0));
    sides.sum()
}

/// Lower bound of the projected area towards `direction` (unit), m2.                        [Gobbetti2003 3.1]
pub fn least_projected_area(cluster: &FaceCluster, direction: Vec3) -> f32 {
    (axes(cluster).z_axis.dot(direction) * normal_projected_area(cluster)).max(0.0)
}
