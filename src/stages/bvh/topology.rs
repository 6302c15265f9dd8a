//! The shape of the tree without its bounds: binary tree by obvhs, widened to four children, levels in a row.

use glam::Vec3;
use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::triangle::Triangle;
use rayon::prelude::*;
use std::time::Duration;

/// No child; `EMPTY` of glsl/lib/bvh.glsl.
pub const EMPTY: u32 = u32::MAX;
/// A leaf: `LEAF | (count - 1) << 24 | first slot`.
pub const LEAF: u32 = 1 << 31;
/// Slots that a leaf can address.
pub const MAX_TRIANGLES: usize = 1 << 24;
/// Entries of the traversal's stack; deeper trees are replaced by balanced ones.
pub const STACK: u32 = 64;
/// Triangles per leaf.
const LEAF_TRIANGLES: usize = 4;

/// Children by node, triangles by slot.
pub struct Topology {
    /// The root first, then level by level; never empty.
    pub children: Vec<[u32; 4]>,
    /// Triangle indices in leaf order.
    pub slots: Vec<u32>,
    /// First node of each level, and the node count.
    pub level_first: Vec<u32>,
}

impl Topology {
    /// Positions must be finite and indices in range.
    pub fn build(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let corner = |index: u32| positions[index as usize].into();
        let corners: Vec<Triangle> =
            triangles.par_iter().map(|t| Triangle { v0: corner(t[0]), v1: corner(t[1]), v2: corner(t[2]) }).collect();
        if corners.is_empty() {
            return Self { children: vec![[EMPTY; 4]], slots: Vec::new(), level_first: vec![0, 1] };
        }
        let params = BvhBuildParams { max_prims_per_leaf: LEAF_TRIANGLES as u32, ..BvhBuildParams::medium_build() };
        let built = widen(&build_bvh2_from_tris(&corners, params, &mut Duration::default()));
        if built.stack_need() <= STACK { built } else { balanced(&corners) }
    }

    /// The most entries a traversal can have on its stack: at each level all children but the one visited.
    pub fn stack_need(&self) -> u32 {
        let mut need = vec![0; self.children.len()];
        // Children come after their parents.
        for (node, children) in self.children.iter().enumerate().rev() {
            let count = children.iter().filter(|&&c| c != EMPTY).count() as u32;
            let inner = children.iter().filter(|&&c| c & LEAF == 0);
            need[node] = count.saturating_sub(1) + inner.map(|&c| need[c as usize]).max().unwrap_or(0);
        }
        need[0]
    }
}

/// Opens the largest inner child of each node until there are four.
fn widen(binary: &Bvh2) -> Topology {
    let mut topology = Topology { children: Vec::new(), slots: Vec::new(), level_first: vec![0] };
    // Binary nodes whose children make up the wide nodes of the present level.
    let mut level: Vec<Vec<usize>> = vec![open(binary, 0)];
    while !level.is_empty() {
        let below_first = (topology.children.len() + level.len()) as u32;
        let mut below = Vec::new();
        for members in &level {
            let mut children = [EMPTY; 4];
            for (child, &member) in children.iter_mut().zip(members) {
                let node = &binary.nodes[member];
                *child = if node.is_leaf() {
                    let first = topology.slots.len() as u32;
                    let range = node.first_index as usize..(node.first_index + node.prim_count) as usize;
                    topology.slots.extend_from_slice(&binary.primitive_indices[range]);
                    LEAF | (node.prim_count - 1) << 24 | first
                } else {
                    below.push(open(binary, member));
                    below_first + below.len() as u32 - 1
                };
            }
            topology.children.push(children);
        }
        topology.level_first.push(topology.children.len() as u32);
        level = below;
    }
    topology
}

/// The up to four descendants of `node` that become the children of a wide node.
fn open(binary: &Bvh2, node: usize) -> Vec<usize> {
    let mut members = vec![node];
    while members.len() < 4 {
        let area = |m: &usize| binary.nodes[*m].aabb().half_area();
        let inner = members.iter().enumerate().filter(|(_, m)| !binary.nodes[**m].is_leaf());
        let Some((largest, _)) = inner.max_by(|a, b| area(a.1).total_cmp(&area(b.1))) else { break };
        let first = binary.nodes[members[largest]].first_index as usize;
        members[largest] = first;
        members.insert(largest + 1, first + 1);
    }
    members
}

/// Splits at the median of the longest axis: less good to trace, but never deeper than the stack allows.
fn balanced(triangles: &[Triangle]) -> Topology {
    let centers: Vec<Vec3> = triangles.par_iter().map(|t| Vec3::from(t.v0 + t.v1 + t.v2) / 3.0).collect();
    let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
    let mut topology = Topology { children: Vec::new(), slots: Vec::new(), level_first: vec![0] };
    // Ranges of `order`, one per node of the present level.
    let mut level = Vec::from([std::ops::Range { start: 0, end: order.len() }]);
    while !level.is_empty() {
        let below_first = (topology.children.len() + level.len()) as u32;
        let mut below = Vec::new();
        for range in &level {
            let mut children = [EMPTY; 4];
            let middle = range.start + split(&mut order[range.clone()], &centers);
            let quarters = [range.start..middle, middle..range.end].map(|half| {
                let quarter = half.start + split(&mut order[half.clone()], &centers);
                [half.start..quarter, quarter..half.end]
            });
            let parts = quarters.into_iter().flatten().filter(|part| !part.is_empty());
            for (child, part) in children.iter_mut().zip(parts) {
                *child = if part.len() <= LEAF_TRIANGLES {
                    let first = topology.slots.len() as u32;
                    topology.slots.extend_from_slice(&order[part.clone()]);
                    LEAF | (part.len() as u32 - 1) << 24 | first
                } else {
                    below.push(part);
                    below_first + below.len() as u32 - 1
                };
            }
            topology.children.push(children);
        }
        topology.level_first.push(topology.children.len() as u32);
        level = below;
    }
    topology
}

/// Puts the lower half along the longest axis first; returns its length.
fn split(order: &mut [u32], centers: &[Vec3]) -> usize {
    let middle = order.len() / 2;
    if order.len() > 1 {
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for &triangle in order.iter() {
            low = low.min(centers[triangle as usize]);
            high = high.max(centers[triangle as usize]);
        }
        let axis = (high - low).max_position();
        // The index decides between equals, so that the tree is the same every time.
        order.select_nth_unstable_by(middle, |&a, &b| {
            centers[a as usize][axis].total_cmp(&centers[b as usize][axis]).then(a.cmp(&b))
        });
    }
    middle
}
