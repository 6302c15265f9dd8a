//! The shape of the tree without its bounds: binary tree by obvhs, widened to four children, levels one after the other.

use glam::Vec3;
use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::triangle::Triangle;
use rayon::prelude::*;
use std::time::Duration;

/// Children of a node.
pub const WIDTH: usize = 4;
/// Triangles of the largest leaf; a child's kind is this count, 0 for no child, or [`KIND_INNER`].
pub const LEAF_TRIANGLES: usize = 2;
/// An inner child; `KIND_INNER` of glsl/lib/bvh_pack.glsl.
pub const KIND_INNER: u32 = 3;
/// Slots and nodes that an entry of the traversal can address.
pub const MAX_TRIANGLES: usize = 1 << 24;
/// Levels that the traversal's stack is made for; deeper trees are replaced by balanced ones.
pub const MAX_LEVELS: usize = 48;

/// A node without its bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Node {
    /// Inner children first, then leaves, then none.
    pub kinds: [u32; WIDTH],
    /// Inner children are this and the following nodes.
    pub first_child: u32,
    /// The triangles of the leaves are in this and the following slots.
    pub first_slot: u32,
}

/// Nodes by level, triangles by slot.
pub struct Topology {
    /// The root first; never empty.
    pub nodes: Vec<Node>,
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
            return Self { nodes: vec![Node::default()], slots: Vec::new(), level_first: vec![0, 1] };
        }
        let params = BvhBuildParams { max_prims_per_leaf: LEAF_TRIANGLES as u32, ..BvhBuildParams::medium_build() };
        let binary = build_bvh2_from_tris(&corners, params, &mut Duration::default());
        let built = widen(&binary);
        if built.level_count() <= MAX_LEVELS { built } else { balanced(&corners) }
    }

    pub fn level_count(&self) -> usize {
        self.level_first.len() - 1
    }

    /// From the root down: `expand` gives the children of a node's key, inner ones as keys and leaves as triangles.
    fn grow<K>(root: K, mut expand: impl FnMut(K) -> (Vec<K>, Vec<Vec<u32>>)) -> Self {
        let mut topology = Self { nodes: Vec::new(), slots: Vec::new(), level_first: vec![0] };
        let mut level = vec![root];
        while !level.is_empty() {
            let below_first = topology.nodes.len() + level.len();
            let mut below = Vec::new();
            for key in level {
                let (inner, leaves) = expand(key);
                let mut kinds = [0; WIDTH];
                kinds[..inner.len()].fill(KIND_INNER);
                for (kind, leaf) in kinds[inner.len()..].iter_mut().zip(&leaves) {
                    *kind = leaf.len() as u32;
                }
                topology.nodes.push(Node {
                    kinds,
                    first_child: (below_first + below.len()) as u32,
                    first_slot: topology.slots.len() as u32,
                });
                topology.slots.extend(leaves.into_iter().flatten());
                below.extend(inner);
            }
            topology.level_first.push(topology.nodes.len() as u32);
            level = below;
        }
        topology
    }
}

/// Opens the largest inner child of each node until there are four.
fn widen(binary: &Bvh2) -> Topology {
    Topology::grow(0, |node| {
        let (leaves, inner): (Vec<usize>, Vec<usize>) =
            open(binary, node).into_iter().partition(|&member| binary.nodes[member].is_leaf());
        let triangles = |leaf: usize| {
            let (first, count) = (binary.nodes[leaf].first_index as usize, binary.nodes[leaf].prim_count as usize);
            binary.primitive_indices[first..first + count].to_vec()
        };
        (inner, leaves.into_iter().map(triangles).collect())
    })
}

/// The up to four descendants of `node` that become the children of a wide node.
fn open(binary: &Bvh2, node: usize) -> Vec<usize> {
    let mut members = vec![node];
    while members.len() < WIDTH {
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
    // A key is a range of `order`.
    Topology::grow(0..order.len(), |range| {
        let middle = range.start + split(&mut order[range.clone()], &centers);
        let quarters = [range.start..middle, middle..range.end].map(|half| {
            let quarter = half.start + split(&mut order[half.clone()], &centers);
            [half.start..quarter, quarter..half.end]
        });
        let parts = quarters.into_iter().flatten().filter(|part| !part.is_empty());
        let (leaves, inner): (Vec<_>, Vec<_>) = parts.partition(|part| part.len() <= LEAF_TRIANGLES);
        (inner, leaves.into_iter().map(|part| order[part].to_vec()).collect())
    })
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
