//! Building the tree on the CPU: median cuts, bounding spheres and cones of normals, depth-first order.
//!
//! [Ritschel2008]: crate::methods::PAPERS

use super::SenderTreeError;
use crate::gpu::shaders::types::SenderLeaf;
use glam::Vec3;

/// Leaves that a tree may have: node indices stay well below 2^31.
pub const MAX_LEAVES: usize = 1 << 26;

crate::choice! {
    /// Which leaf stands for an inner node where it is not drawn by chance.
    pub enum Representative {
        /// The one found by following the child with more power
        Intensity = "intensity",
        /// The one found by following the child with more area
        Area = "area",
    }
}

crate::choice! {
    /// How nodes lie in memory.
    pub enum NodeLayout {
        /// 64 bytes, of which the walk reads 32
        Wide = "wide",
        /// The paper's 16 bytes, for up to 65535 nodes
        Compact = "compact",
    }
}

/// How the tree is cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TreeOptions {
    /// How much a difference of normals counts beside distance: 0 cuts by position alone (the paper), 1 takes opposite
    /// normals for as far apart as the two ends of the scene.
    pub normal_weight: f32,
    pub representative: Representative,
    pub layout: NodeLayout,
}

impl Default for TreeOptions {
    fn default() -> Self {
        Self { normal_weight: 0.25, representative: Representative::Intensity, layout: NodeLayout::Wide }
    }
}

/// A node as it lies in memory, in depth-first order: the left child of inner node `i` is `i + 1`, the right one
/// `nodes[i + 1].skip`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Node {
    /// Bounding sphere of all corners below, metres.
    pub centre: Vec3,
    pub radius: f32,
    /// Unit: all normals below lie within a cone about it.
    pub axis: Vec3,
    /// Cosine of the cone's half angle; -1 where normals point everywhere.
    pub cos_cone: f32,
    /// m2, of all leaves below.
    pub area: f32,
    /// The node after this subtree; the number of nodes where there is none.
    pub skip: u32,
    /// In tree order: a leaf's own, or the first below an inner node.
    pub leaf: u32,
}

/// The tree as plain data.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TreeTopology {
    pub nodes: Vec<Node>,
    /// Index of the leaf in the owner's list, in tree order. Leaves without area are left out.
    pub leaf_order: Vec<u32>,
    /// Node of each leaf, in tree order.
    pub leaf_nodes: Vec<u32>,
    /// Inner nodes by depth, the root first.
    pub level_nodes: Vec<u32>,
    /// Where each level starts in `level_nodes`, and their number at the end.
    pub level_first: Vec<u32>,
}

/// Corners of a leaf, counter-clockwise seen from its front; a triangle repeats its last.
pub fn corners(leaf: &SenderLeaf) -> [Vec3; 4] {
    let (u, v) = (leaf.edge_u, leaf.edge_v);
    if leaf.is_triangle != 0 {
        let first = leaf.centre - (u + v) / 3.0;
        [first, first + u, first + v, first + v]
    } else {
        let first = leaf.centre - 0.5 * (u + v);
        [first, first + u, first + u + v, first + v]
    }
}

/// m2.
pub fn area(leaf: &SenderLeaf) -> f32 {
    leaf.edge_u.cross(leaf.edge_v).length() * if leaf.is_triangle != 0 { 0.5 } else { 1.0 }
}

/// Unit, towards the side that sends.
pub fn normal(leaf: &SenderLeaf) -> Vec3 {
    leaf.edge_u.cross(leaf.edge_v).normalize_or_zero()
}

struct Builder<'a> {
    leaves: &'a [SenderLeaf],
    normals: Vec<Vec3>,
    /// Metres that a difference of normals of 1 stands for.
    normal_scale: f32,
    tree: TreeTopology,
    /// Inner nodes of each depth.
    levels: Vec<Vec<u32>>,
}

impl TreeTopology {
    /// Cuts at the median of the longest axis until single leaves are left.                    [Ritschel2008 4.2]
    pub fn build(leaves: &[SenderLeaf], options: TreeOptions) -> Result<Self, SenderTreeError> {
        if leaves.len() > MAX_LEAVES {
            return Err(SenderTreeError::TooManyLeaves { count: leaves.len() });
        }
        let is_sound = |leaf: &SenderLeaf| leaf.centre.is_finite() && area(leaf).is_finite();
        if let Some(index) = leaves.iter().position(|leaf| !is_sound(leaf)) {
            return Err(SenderTreeError::NotFinite { index, centre: leaves[index].centre });
        }
        let mut order: Vec<u32> = (0..leaves.len() as u32).filter(|&i| area(&leaves[i as usize]) > 0.0).collect();
        let (low, high) = bounds(order.iter().map(|&i| leaves[i as usize].centre));
        let mut builder = Builder {
            leaves,
            normals: leaves.iter().map(normal).collect(),
            normal_scale: 0.5 * options.normal_weight.max(0.0) * (high - low).length(),
            tree: Self::default(),
            levels: Vec::new(),
        };
        if !order.is_empty() {
            builder.subtree(&mut order, 0);
        }
        let Builder { mut tree, levels, .. } = builder;
        tree.level_first.push(0);
        for level in levels {
            tree.level_nodes.extend(level);
            tree.level_first.push(tree.level_nodes.len() as u32);
        }
        Ok(tree)
    }
}

impl Builder<'_> {
    /// Appends the subtree over `order`, which holds at least one leaf. Medians keep the depth at log2 of the count.
    fn subtree(&mut self, order: &mut [u32], depth: usize) {
        let index = self.tree.nodes.len();
        let mut node = self.summary(order);
        node.leaf = self.tree.leaf_order.len() as u32;
        self.tree.nodes.push(node);
        if let [leaf] = order {
            self.tree.leaf_order.push(*leaf);
            self.tree.leaf_nodes.push(index as u32);
        } else {
            if self.levels.len() == depth {
                self.levels.push(Vec::new());
            }
            self.levels[depth].push(index as u32);
            let middle = order.len() / 2;
            self.cut(order, middle);
            let (left, right) = order.split_at_mut(middle);
            self.subtree(left, depth + 1);
            self.subtree(right, depth + 1);
        }
        self.tree.nodes[index].skip = self.tree.nodes.len() as u32;
    }

    /// Brings the lower half along the longest axis of positions (or of normals) to the front.
    fn cut(&self, order: &mut [u32], middle: usize) {
        let extent = |of: &dyn Fn(u32) -> Vec3| {
            let (low, high) = bounds(order.iter().map(|&i| of(i)));
            high - low
        };
        let centre = |i: u32| self.leaves[i as usize].centre;
        let bent = |i: u32| self.normals[i as usize] * self.normal_scale;
        let (spread, bend) = (extent(&centre), extent(&bent));
        let by_normal = bend.max_element() > spread.max_element();
        let axis = if by_normal { bend.max_position() } else { spread.max_position() };
        let key = |&i: &u32| if by_normal { bent(i)[axis] } else { centre(i)[axis] };
        // Ties by index: the same leaves give the same tree.
        order.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
    }

    /// Sphere, cone and area of the leaves of `order`.
    fn summary(&self, order: &[u32]) -> Node {
        let points = || order.iter().flat_map(|&i| corners(&self.leaves[i as usize]));
        let (low, high) = bounds(points());
        let centre = low.midpoint(high);
        let radius = points().map(|p| p.distance(centre)).fold(0.0, f32::max);
        let (mut area_sum, mut normal_sum) = (0.0, Vec3::ZERO);
        for &i in order {
            let area = area(&self.leaves[i as usize]);
            area_sum += area;
            normal_sum += area * self.normals[i as usize];
        }
        let axis = normal_sum.normalize_or(self.normals[order[0] as usize]);
        let cosine = order.iter().map(|&i| axis.dot(self.normals[i as usize])).fold(1.0, f32::min);
        // A little wider than rounding, so that no normal and no corner falls out.
        let cos_cone = if cosine < -0.99 { -1.0 } else { (cosine - 1e-5).max(-1.0) };
        Node { centre, radius: radius * 1.000_01, axis, cos_cone, area: area_sum, skip: 0, leaf: 0 }
    }
}

fn bounds(points: impl Iterator<Item = Vec3>) -> (Vec3, Vec3) {
    points.fold((Vec3::MAX, Vec3::MIN), |(low, high), p| (low.min(p), high.max(p)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stages::sender_tree::{parallelogram, triangle};

    fn leaves(count: u32) -> Vec<SenderLeaf> {
        let hash = |i: u32| (i.wrapping_mul(2_654_435_761) >> 8) as f32 / 16_777_216.0;
        (0..count)
            .map(|i| {
                let at = |k: u32| Vec3::new(hash(9 * i + k), hash(9 * i + k + 1), hash(9 * i + k + 2));
                let (centre, u, v) = (at(0) * 4.0, (at(3) - 0.5) * 0.2, (at(6) - 0.5) * 0.2);
                if i % 3 == 0 { parallelogram(centre, u, v) } else { triangle([centre, centre + u, centre + v]) }
            })
            .collect()
    }

    /// What is wrong with a tree, if anything.
    fn fault(tree: &TreeTopology, leaves: &[SenderLeaf]) -> Option<String> {
        let count = tree.nodes.len();
        let mut seen = vec![0; tree.leaf_order.len()];
        for (i, node) in tree.nodes.iter().enumerate() {
            let skip = node.skip as usize;
            if skip <= i || skip > count {
                return Some(format!("node {i} of {count} skips to {skip}"));
            }
            let mut area_below = 0.0;
            for below in i..skip {
                if tree.nodes[below].skip as usize != below + 1 {
                    continue;
                }
                let leaf = &leaves[tree.leaf_order[tree.nodes[below].leaf as usize] as usize];
                area_below += area(leaf);
                if corners(leaf).iter().any(|p| p.distance(node.centre) > node.radius) {
                    return Some(format!("leaf node {below} leaves the sphere of node {i}"));
                }
                if normal(leaf).dot(node.axis) < node.cos_cone {
                    return Some(format!("leaf node {below} leaves the cone of node {i}"));
                }
            }
            if (area_below - node.area).abs() > 1e-4 * node.area {
                return Some(format!("node {i}: area {} for {area_below}", node.area));
            }
            if skip == i + 1 {
                seen[node.leaf as usize] += 1;
                if tree.leaf_nodes[node.leaf as usize] as usize != i {
                    return Some(format!("leaf {} is not at node {i}", node.leaf));
                }
            } else if tree.nodes[tree.nodes[i + 1].skip as usize].skip as usize != skip {
                return Some(format!("the children of node {i} do not fill it"));
            }
        }
        if seen.iter().any(|&times| times != 1) {
            return Some("a leaf is not there exactly once".into());
        }
        let inner = tree.level_nodes.len();
        (inner + tree.leaf_order.len() != count).then(|| format!("{inner} inner nodes of {count}"))
    }

    #[test]
    fn trees_of_all_sizes_are_sound() {
        for count in [0, 1, 2, 3, 63, 64, 65, 1009] {
            for normal_weight in [0.0, 0.25, 1.0] {
                let leaves = leaves(count);
                let tree =
                    TreeTopology::build(&leaves, TreeOptions { normal_weight, ..TreeOptions::default() }).unwrap();
                assert_eq!(fault(&tree, &leaves), None, "{count} leaves");
                assert_eq!(
                    tree,
                    TreeTopology::build(&leaves, TreeOptions { normal_weight, ..TreeOptions::default() }).unwrap()
                );
                let depth = tree.level_first.len() - 1;
                assert!(depth <= (count.max(1) as f32).log2().ceil() as usize, "{count} leaves, {depth} levels");
            }
        }
    }

    #[test]
    fn faults_are_found() {
        let leaves = leaves(100);
        let sound = TreeTopology::build(&leaves, TreeOptions::default()).unwrap();
        let spoilt = |change: &dyn Fn(&mut TreeTopology)| {
            let mut tree = sound.clone();
            change(&mut tree);
            fault(&tree, &leaves).is_some()
        };
        assert!(spoilt(&|tree| tree.nodes[3].skip = 3));
        assert!(spoilt(&|tree| tree.nodes[3].skip -= 1));
        assert!(spoilt(&|tree| tree.nodes[5].radius *= 0.9));
        assert!(spoilt(&|tree| tree.nodes[0].cos_cone = 0.9));
        assert!(spoilt(&|tree| tree.nodes[7].area *= 1.1));
        assert!(spoilt(&|tree| tree.leaf_order[4] = tree.leaf_order[5]));
    }

    #[test]
    fn leaves_without_area_are_left_out_and_broken_ones_refused() {
        let mut leaves = leaves(10);
        leaves[4].edge_v = Vec3::ZERO;
        let tree = TreeTopology::build(&leaves, TreeOptions::default()).unwrap();
        assert_eq!(tree.leaf_order.len(), 9);
        assert!(!tree.leaf_order.contains(&4));
        leaves[6].centre.y = f32::NAN;
        let error = TreeTopology::build(&leaves, TreeOptions::default()).unwrap_err();
        assert!(matches!(error, SenderTreeError::NotFinite { index: 6, .. }), "{error}");
    }
}
