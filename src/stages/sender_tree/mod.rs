//! The sender tree: whatever sends light, as a binary tree that a gather walks without a stack.   [Ritschel2008 4.2]
//!
//! Any method fills one with its elements as leaves, and the per-pixel final gather shows its solution:
//!
//! 1. [`SenderTree::build`] once per pose, from flat leaves: [`triangle`]s, [`parallelogram`]s or [`disc`]s, seen from
//!    one side each ([`triangle_leaves`] makes them of a scene's triangles, both sides where they have two);
//! 2. per frame, write what every leaf sends, W/m2, to two buffers in the order in which the leaves were given: what it
//!    emits itself, and what it reflects;
//! 3. [`SenderTree::pull`] sums it up the tree.
//!
//! | paper | here | unit | buffer |
//! |---|---|---|---|
//! | N | [`Node`]: sphere, cone, skip | m, 1 | `sender_tree/nodes` |
//! | child | `i + 1` | – | – |
//! | skip | [`Node::skip`] | – | `sender_tree/nodes` |
//! | intensity I | power / pi along the normal | W/sr | `sender_tree/light` |
//!
//! What it does not do: it knows no receivers and no visibility; those are the gather's.
//!
//! [Ritschel2008]: crate::methods::PAPERS

mod build;
mod leaves;

pub use build::{MAX_LEAVES, Node, NodeLayout, Representative, TreeOptions, TreeTopology, area, corners, normal};
pub use leaves::{VertexElements, VertexLeaves, disc, parallelogram, triangle, triangle_leaves};

use crate::gpu::shaders::sender_tree as passes;
use crate::gpu::shaders::types::{LeafLight, SenderFrame, SenderLeaf};
use crate::gpu::{Buffer, Context, GpuError, Recorder, TexelBuffer};
use glam::Vec3;

/// Texels of a node and of its light; the layout is that of `glsl/lib/sender_tree.glsl`.
const NODE_TEXELS: usize = 3;
const LIGHT_TEXELS: usize = 2;
/// Nodes that 16 bits can point behind.
pub const MAX_COMPACT_NODES: usize = 65_535;

/// Why there is no tree.
#[derive(Debug, thiserror::Error)]
pub enum SenderTreeError {
    #[error("{count} senders; a tree takes at most {MAX_LEAVES}: lower --elements or the atlas' resolution")]
    TooManyLeaves { count: usize },
    #[error("sender {index} at {centre} is not finite; repair the scene's vertices there")]
    NotFinite { index: usize, centre: Vec3 },
    #[error("{nodes} nodes; the compact layout takes at most {MAX_COMPACT_NODES}: use the wide one, or fewer senders")]
    TooManyNodes { nodes: usize },
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

/// The tree on the device.
pub struct SenderTree {
    pub topology: TreeTopology,
    /// What the walk reads: node_count, depth first, in the layout that was asked for.
    nodes: TexelBuffer,
    compact: Option<TexelBuffer>,
    /// One: what compact nodes are quantised in.
    pub frame: Buffer<SenderFrame>,
    /// Power of every node, W.
    pub light: TexelBuffer,
    /// leaf_count, in tree order.
    pub leaves: Buffer<SenderLeaf>,
    /// leaf_count, in tree order, W/m2.
    pub leaf_light: Buffer<LeafLight>,
    /// One value: log-average luminance of what the leaves reflect, W m^-2 sr^-1.
    pub adaptation: Buffer<f32>,
    leaf_order: Buffer<u32>,
    leaf_nodes: Buffer<u32>,
    level_nodes: Buffer<u32>,
    /// Leaves as they were given; the length of the light buffers.
    owner_count: usize,
    representative: Representative,
}

impl SenderTree {
    /// Builds over `leaves` (world space) on the CPU and uploads. Leaves without area are left out.
    pub fn build(context: &Context, leaves: &[SenderLeaf], options: TreeOptions) -> Result<Self, SenderTreeError> {
        let topology = TreeTopology::build(leaves, options)?;
        let count = topology.nodes.len();
        let is_compact = options.layout == NodeLayout::Compact;
        if is_compact && count > MAX_COMPACT_NODES {
            return Err(SenderTreeError::TooManyNodes { nodes: count });
        }
        let ordered: Vec<SenderLeaf> = topology.leaf_order.iter().map(|&i| leaves[i as usize]).collect();
        let texels: Vec<[[u32; 4]; NODE_TEXELS]> = topology.nodes.iter().map(node_texels).collect();
        let tree = Self {
            nodes: context.texel_buffer("sender_tree/nodes", NODE_TEXELS * count.max(1))?,
            compact: is_compact.then(|| context.texel_buffer("sender_tree/compact nodes", count.max(1))).transpose()?,
            frame: context.upload("sender_tree/frame", &[frame(&topology)])?,
            light: context.texel_buffer("sender_tree/light", LIGHT_TEXELS * count.max(1))?,
            leaf_light: context.buffer("sender_tree/leaf light", ordered.len())?,
            leaves: context.upload("sender_tree/leaves", &ordered)?,
            adaptation: context.buffer("sender_tree/adaptation", 1)?,
            leaf_order: context.upload("sender_tree/leaf order", &topology.leaf_order)?,
            leaf_nodes: context.upload("sender_tree/leaf nodes", &topology.leaf_nodes)?,
            level_nodes: context.upload("sender_tree/level nodes", &topology.level_nodes)?,
            owner_count: leaves.len(),
            representative: options.representative,
            topology,
        };
        context.write(tree.nodes.buffer(), texels.as_flattened())?;
        Ok(tree)
    }

    /// What the walk reads, and whether it is compact.
    pub fn nodes(&self) -> (&TexelBuffer, bool) {
        match &self.compact {
            Some(compact) => (compact, true),
            None => (&self.nodes, false),
        }
    }

    pub fn node_count(&self) -> u32 {
        self.topology.nodes.len() as u32
    }

    pub fn leaf_count(&self) -> u32 {
        self.leaves.len() as u32
    }

    /// Takes over what the leaves send (W/m2, in the order they were given, one entry each) and sums it upwards.
    pub fn pull(&self, recorder: &mut Recorder<'_>, emitted: &Buffer<Vec3>, reflected: &Buffer<Vec3>) {
        debug_assert!(emitted.len() >= self.owner_count && reflected.len() >= self.owner_count);
        recorder.scope("pull", |recorder| {
            let leaf_count = self.leaf_count();
            recorder.dispatch(
                &passes::LeafLight {
                    leaf_order: &self.leaf_order,
                    leaf_nodes: &self.leaf_nodes,
                    leaves: &self.leaves,
                    emitted,
                    reflected,
                    leaf_light: &self.leaf_light,
                    sender_light: self.light.buffer(),
                    params: passes::LeafLightParams { leaf_count },
                },
                leaf_count,
            );
            for level in self.topology.level_first.windows(2).rev() {
                let count = level[1] - level[0];
                let pass = passes::Pull {
                    level_nodes: &self.level_nodes,
                    node_texels: self.nodes.buffer(),
                    sender_light: self.light.buffer(),
                    params: passes::PullParams {
                        first: level[0],
                        count,
                        by_area: u32::from(self.representative == Representative::Area),
                    },
                };
                recorder.dispatch(&pass, count);
            }
            let pass = passes::Adaptation {
                leaves: &self.leaves,
                leaf_light: &self.leaf_light,
                adaptation: &self.adaptation,
                params: passes::AdaptationParams { leaf_count },
            };
            recorder.dispatch(&pass, 256u32);
            if let Some(compact) = &self.compact {
                let pass = passes::Pack {
                    wide_nodes: &self.nodes,
                    sender_light: &self.light,
                    compact_nodes: compact.buffer(),
                    tree_frame: &self.frame,
                    params: passes::PackParams { node_count: self.node_count() },
                };
                recorder.dispatch(&pass, self.node_count());
            }
        });
    }

    /// Bytes of all tables.
    pub fn size_bytes(&self) -> u64 {
        self.nodes.size_bytes()
            + self.light.size_bytes()
            + self.leaves.size_bytes()
            + self.leaf_light.size_bytes()
            + self.leaf_order.size_bytes()
            + self.leaf_nodes.size_bytes()
            + self.level_nodes.size_bytes()
    }
}

/// Room for all centres, and for the root's sphere moved by rounding.
fn frame(topology: &TreeTopology) -> SenderFrame {
    let centres = topology.nodes.iter().map(|node| node.centre);
    let (low, high) = centres.fold((Vec3::MAX, Vec3::MIN), |(low, high), c| (low.min(c), high.max(c)));
    if low.x > high.x {
        return SenderFrame { low: Vec3::ZERO, largest_radius: 1.0, extent: Vec3::ONE, largest_power: 0.0 };
    }
    let extent = high - low;
    let radius = topology.nodes.iter().map(|node| node.radius).fold(0.0, f32::max);
    let largest_radius = 1.001 * (radius + extent.length() / 255.0);
    SenderFrame { low, largest_radius, extent, largest_power: 0.0 }
}

fn node_texels(node: &Node) -> [[u32; 4]; NODE_TEXELS] {
    let words = |v: Vec3, w: f32| [v.x, v.y, v.z, w].map(f32::to_bits);
    [words(node.centre, node.radius), words(node.axis, node.cos_cone), [node.area.to_bits(), node.skip, node.leaf, 0]]
}
