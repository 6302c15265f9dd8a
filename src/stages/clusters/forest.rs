//! The order of a cluster tree: from joins to preorder, with every cluster's faces in one range.
//!
//! Components are joined at the top by place; below `DEEP` levels a subtree is halved instead, so that no mesh makes
//! a tree deeper than [`super::MAX_DEPTH`].

use super::contract::Merges;
use super::{MAX_DEPTH, MeshFaces};
use glam::Vec3;

/// From here on a subtree is halved: 2^32 faces need 32 levels more.
const DEEP: u32 = MAX_DEPTH - 32;

/// Clusters in preorder.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Forest {
    /// Faces of each cluster.
    pub counts: Vec<u32>,
    /// No face of the cluster sees another's front.
    pub convex: Vec<bool>,
    /// Triangle at each place.
    pub faces: Vec<u32>,
    /// Levels below the root.
    pub depth: u32,
}

/// The joins as a tree.
struct Nodes {
    face_count: u32,
    /// Of node `face_count + k`.
    children: Vec<[u32; 2]>,
    convex: Vec<bool>,
    /// Faces below each node.
    counts: Vec<u32>,
    /// Sum of the centres of the faces below each node.
    centers: Vec<Vec3>,
}

impl Nodes {
    fn push(&mut self, pair: [u32; 2], is_convex: bool) -> u32 {
        let [a, b] = pair.map(|node| node as usize);
        self.children.push(pair);
        self.convex.push(is_convex);
        self.counts.push(self.counts[a] + self.counts[b]);
        self.centers.push(self.centers[a] + self.centers[b]);
        (self.counts.len() - 1) as u32
    }

    fn center(&self, node: u32) -> Vec3 {
        self.centers[node as usize] / self.counts[node as usize] as f32
    }

    fn children(&self, node: u32) -> Option<[u32; 2]> {
        node.checked_sub(self.face_count).map(|k| self.children[k as usize])
    }

    /// Halves at the median of the longest axis, until one is left.
    fn join_all(&mut self, roots: &mut [u32]) -> u32 {
        if let [root] = roots {
            return *root;
        }
        let places = || roots.iter().map(|&root| self.center(root));
        let (low, high) = places().fold((Vec3::MAX, Vec3::MIN), |(low, high), p| (low.min(p), high.max(p)));
        let axis = (high - low).max_position();
        roots.sort_by(|&a, &b| self.center(a)[axis].total_cmp(&self.center(b)[axis]).then(a.cmp(&b)));
        let (left, right) = roots.split_at_mut(roots.len() / 2);
        let pair = [self.join_all(left), self.join_all(right)];
        self.push(pair, false)
    }
}

impl Forest {
    /// Orders `merges` of `mesh`, which has at least one face.
    pub fn new(mesh: &MeshFaces<'_>, merges: &Merges) -> Self {
        let face_count = mesh.triangles.len();
        let center = |t: &[u32; 3]| t.iter().map(|&v| mesh.positions[v as usize]).sum::<Vec3>() / 3.0;
        let mut nodes = Nodes {
            face_count: face_count as u32,
            children: Vec::with_capacity(face_count),
            convex: Vec::with_capacity(face_count),
            counts: vec![1; face_count],
            centers: mesh.triangles.iter().map(center).collect(),
        };
        let mut is_root = vec![true; face_count + merges.pairs.len()];
        for (&pair, &is_convex) in merges.pairs.iter().zip(&merges.convex) {
            nodes.push(pair, is_convex);
            pair.iter().for_each(|&node| is_root[node as usize] = false);
        }
        let mut roots: Vec<u32> = (0..is_root.len() as u32).filter(|&node| is_root[node as usize]).collect();
        let root = nodes.join_all(&mut roots);

        let mut forest = Self::default();
        let mut stack = vec![(root, 0)];
        while let Some((node, depth)) = stack.pop() {
            if depth >= DEEP {
                let faces = faces_below(&nodes, node);
                forest.push_halves(&faces, depth);
                continue;
            }
            let convex = node.checked_sub(nodes.face_count).is_none_or(|k| nodes.convex[k as usize]);
            forest.push(nodes.counts[node as usize], convex, depth);
            match nodes.children(node) {
                None => forest.faces.push(node),
                // The larger half first.
                Some([a, b]) if nodes.counts[a as usize] < nodes.counts[b as usize] => {
                    stack.extend([(a, depth + 1), (b, depth + 1)]);
                }
                Some([a, b]) => stack.extend([(b, depth + 1), (a, depth + 1)]),
            }
        }
        forest
    }

    fn push(&mut self, count: u32, is_convex: bool, depth: u32) {
        self.counts.push(count);
        self.convex.push(is_convex);
        self.depth = self.depth.max(depth);
    }

    fn push_halves(&mut self, faces: &[u32], depth: u32) {
        self.push(faces.len() as u32, faces.len() == 1, depth);
        if let [face] = faces {
            self.faces.push(*face);
        } else {
            let (left, right) = faces.split_at(faces.len().div_ceil(2));
            self.push_halves(left, depth + 1);
            self.push_halves(right, depth + 1);
        }
    }
}

fn faces_below(nodes: &Nodes, root: u32) -> Vec<u32> {
    let (mut faces, mut stack) = (Vec::new(), vec![root]);
    while let Some(node) = stack.pop() {
        match nodes.children(node) {
            None => faces.push(node),
            Some([a, b]) => stack.extend([b, a]),
        }
    }
    faces
}
