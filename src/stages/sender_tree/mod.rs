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
mod octahedral;

pub use build::{MAX_LEAVES, Node, NodeLayout, Representative, TreeOptions, TreeTopology, area, corners, normal};
pub use leaves::{VertexElements, VertexLeaves, disc, parallelogram, triangle, triangle_leaves};

use crate::gpu::shaders::sender_tree as passes;
use crate::gpu::shaders::types::{SenderFrame, SenderLeaf};
use crate::gpu::{Buffer, Context, GpuError, Recorder, TexelBuffer};
use glam::{UVec2, Vec3};

/// Texels of a node, of its light, of a leaf; `glsl/lib/sender_tree.glsl` and `sender_leaf.glsl` say what is where.
const NODE_TEXELS: usize = 2;
const LIGHT_TEXELS: usize = 2;
const LEAF_TEXELS: usize = 4;
/// Bins of a table of directions are words of four.
const fn gloss_texels(side: u32) -> u32 {
    1 + (side * side).div_ceil(4)
}
/// In place of a right child: a leaf has none. The same constant stands in `lib/sender_tree.glsl`.
pub const NO_SENDER: u32 = u32::MAX;
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

/// What a leaf sends, W/m2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeafLight {
    pub emitted: Vec3,
    pub reflected: Vec3,
}

/// Leaves that send otherwise along each direction.
#[derive(Debug, Clone, Copy)]
pub struct ShinyLeaves<'a> {
    /// Of each leaf as it was given: its row from 1, each row once; 0 where it sends evenly.
    pub rows: &'a [u32],
    /// Their hemispheres have side x side bins, `glsl/lib/hemisphere_bins.glsl`.
    pub side: u32,
}

/// The tree on the device.
pub struct SenderTree {
    pub topology: TreeTopology,
    /// What the walk reads: node_count, depth first; the power in it is that of the last pull.
    nodes: TexelBuffer,
    /// The same in the paper's layout, where that was asked for.
    compact: Option<TexelBuffer>,
    /// m2, of every node.
    areas: Buffer<f32>,
    /// One: what compact nodes are quantised in.
    pub frame: Buffer<SenderFrame>,
    /// Power of every node, W.
    pub light: TexelBuffer,
    /// Of every node, by which a leaf below it is drawn.
    pub branches: TexelBuffer,
    /// leaf_count, in tree order: shapes, and what they send.
    pub leaves: TexelBuffer,
    /// One value: log-average luminance of what the leaves reflect, W m^-2 sr^-1.
    pub adaptation: Buffer<f32>,
    /// Slot and row of each shiny leaf.
    glossy_leaves: Buffer<UVec2>,
    glossy_count: u32,
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
        Self::with_shiny(context, leaves, ShinyLeaves { rows: &[], side: 0 }, options)
    }

    /// As [`Self::build`], with room for what shiny leaves send along each direction.
    pub fn with_shiny(
        context: &Context,
        leaves: &[SenderLeaf],
        shiny: ShinyLeaves<'_>,
        options: TreeOptions,
    ) -> Result<Self, SenderTreeError> {
        let row_of = |owner: u32| shiny.rows.get(owner as usize).copied().unwrap_or(0);
        let topology = TreeTopology::build(leaves, options)?;
        let count = topology.nodes.len();
        let is_compact = options.layout == NodeLayout::Compact;
        if is_compact && count > MAX_COMPACT_NODES {
            return Err(SenderTreeError::TooManyNodes { nodes: count });
        }
        let shapes: Vec<[[u32; 4]; LEAF_TEXELS]> =
            topology.leaf_order.iter().map(|&i| leaf_texels(&leaves[i as usize], row_of(i))).collect();
        let glossy_leaves: Vec<UVec2> = (0..)
            .zip(topology.leaf_order.iter().map(|&owner| row_of(owner)))
            .filter(|&(_, row)| row != 0)
            .map(|(slot, row)| UVec2::new(slot, row))
            .collect();
        let glossy_count = glossy_leaves.len() as u32;
        let row_count = glossy_leaves.iter().map(|leaf| leaf.y).max().unwrap_or(0);
        let gloss_texels = row_count as usize * gloss_texels(shiny.side) as usize;
        let texels: Vec<[[u32; 4]; NODE_TEXELS]> = topology.nodes.iter().map(node_texels).collect();
        let tree = Self {
            nodes: context.texel_buffer("sender_tree/nodes", NODE_TEXELS * count.max(1))?,
            compact: is_compact.then(|| context.texel_buffer("sender_tree/compact nodes", count.max(1))).transpose()?,
            areas: context
                .upload("sender_tree/areas", &topology.nodes.iter().map(|node| node.area).collect::<Vec<_>>())?,
            frame: context.upload("sender_tree/frame", &[frame(&topology, shiny.side)])?,
            light: context.texel_buffer("sender_tree/light", LIGHT_TEXELS * count.max(1))?,
            branches: context.texel_buffer("sender_tree/branches", count.max(1))?,
            leaves: context.texel_buffer("sender_tree/leaves", LEAF_TEXELS * shapes.len().max(1) + gloss_texels)?,
            adaptation: context.buffer("sender_tree/adaptation", 1)?,
            glossy_leaves: context.upload("sender_tree/glossy leaves", &glossy_leaves)?,
            glossy_count,
            leaf_order: context.upload("sender_tree/leaf order", &topology.leaf_order)?,
            leaf_nodes: context.upload("sender_tree/leaf nodes", &topology.leaf_nodes)?,
            level_nodes: context.upload("sender_tree/level nodes", &topology.level_nodes)?,
            owner_count: leaves.len(),
            representative: options.representative,
            topology,
        };
        context.write(tree.nodes.buffer(), texels.as_flattened())?;
        context.write(tree.branches.buffer(), &branches(&tree.topology))?;
        context.write(tree.leaves.buffer(), shapes.as_flattened())?;
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
        self.topology.leaf_order.len() as u32
    }

    /// Takes over what the leaves send (W/m2, in the order they were given, one entry each) and sums it upwards.
    pub fn pull(&self, recorder: &mut Recorder<'_>, emitted: &Buffer<Vec3>, reflected: &Buffer<Vec3>) {
        self.pull_with(recorder, emitted, reflected, None);
    }

    /// ... and what shiny leaves send besides, by rows and bins: W m^-2 sr^-1 as `encode_32` of
    /// `glsl/lib/shared_exponent.glsl`; nothing where there is none.
    pub fn pull_with(
        &self,
        recorder: &mut Recorder<'_>,
        emitted: &Buffer<Vec3>,
        reflected: &Buffer<Vec3>,
        sent: Option<&Buffer<u32>>,
    ) {
        debug_assert!(emitted.len() >= self.owner_count && reflected.len() >= self.owner_count);
        recorder.scope("pull", |recorder| {
            let leaf_count = self.leaf_count();
            recorder.dispatch(
                &passes::LeafLight {
                    leaf_order: &self.leaf_order,
                    leaf_nodes: &self.leaf_nodes,
                    emitted,
                    reflected,
                    sender_leaves: self.leaves.buffer(),
                    sender_light: self.light.buffer(),
                    node_texels: self.nodes.buffer(),
                    params: passes::LeafLightParams { leaf_count },
                },
                leaf_count,
            );
            if self.glossy_count > 0 {
                let pass = passes::LeafGloss {
                    glossy_leaves: &self.glossy_leaves,
                    leaf_nodes: &self.leaf_nodes,
                    sent: sent.unwrap_or(&self.leaf_order),
                    tree_frame: &self.frame,
                    sender_leaves: self.leaves.buffer(),
                    sender_light: self.light.buffer(),
                    node_texels: self.nodes.buffer(),
                    params: passes::LeafGlossParams {
                        glossy_count: self.glossy_count,
                        is_dark: u32::from(sent.is_none()),
                    },
                };
                recorder.dispatch(&pass, self.glossy_count);
            }
            for level in self.topology.level_first.windows(2).rev() {
                let count = level[1] - level[0];
                let pass = passes::Pull {
                    level_nodes: &self.level_nodes,
                    node_areas: &self.areas,
                    sender_light: self.light.buffer(),
                    node_texels: self.nodes.buffer(),
                    branches: self.branches.buffer(),
                    params: passes::PullParams {
                        first: level[0],
                        count,
                        by_area: u32::from(self.representative == Representative::Area),
                    },
                };
                recorder.dispatch(&pass, count);
            }
            let pass = passes::Adaptation {
                sender_leaves: &self.leaves,
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

    /// What every leaf sends since the last pull, in tree order; of shiny ones what leaves them in all directions together.
    pub fn leaf_light(&self, context: &Context) -> Result<Vec<LeafLight>, GpuError> {
        let texels = context.download(self.leaves.buffer())?;
        let [frame] = context.download(&self.frame)?[..] else { return Ok(Vec::new()) };
        let light = |leaf: &[[u32; 4]]| {
            let [.., emitted_r, emitted_g] = leaf[2].map(f32::from_bits);
            let [emitted_b, r, g, b] = leaf[3].map(f32::from_bits);
            let by_lobe = match leaf[0][3] >> 1 {
                0 => Vec3::ZERO,
                row => {
                    let first = frame.gloss_first + (row - 1) * gloss_texels(frame.gloss_side);
                    let [r, g, b, _] = texels[first as usize].map(f32::from_bits);
                    Vec3::new(r, g, b)
                }
            };
            LeafLight { emitted: Vec3::new(emitted_r, emitted_g, emitted_b), reflected: Vec3::new(r, g, b) + by_lobe }
        };
        Ok(texels.chunks(LEAF_TEXELS).take(self.topology.leaf_order.len()).map(light).collect())
    }

    /// Bytes of all tables.
    pub fn size_bytes(&self) -> u64 {
        self.nodes.size_bytes()
            + self.compact.as_ref().map_or(0, TexelBuffer::size_bytes)
            + self.areas.size_bytes()
            + self.light.size_bytes()
            + self.leaves.size_bytes()
            + self.branches.size_bytes()
            + self.glossy_leaves.size_bytes()
            + self.leaf_order.size_bytes()
            + self.leaf_nodes.size_bytes()
            + self.level_nodes.size_bytes()
    }
}

/// Room for all centres, and for the root's sphere moved by rounding.
fn frame(topology: &TreeTopology, gloss_side: u32) -> SenderFrame {
    let gloss_first = (LEAF_TEXELS * topology.leaf_order.len().max(1)) as u32;
    let centres = topology.nodes.iter().map(|node| node.centre);
    let (low, high) = centres.fold((Vec3::MAX, Vec3::MIN), |(low, high), c| (low.min(c), high.max(c)));
    if low.x > high.x {
        return SenderFrame {
            low: Vec3::ZERO,
            largest_radius: 1.0,
            extent: Vec3::ONE,
            largest_power: 0.0,
            gloss_first,
            gloss_side,
        };
    }
    let extent = high - low;
    let radius = topology.nodes.iter().map(|node| node.radius).fold(0.0, f32::max);
    let largest_radius = 1.001 * (radius + extent.length() / 255.0);
    SenderFrame { low, largest_radius, extent, largest_power: 0.0, gloss_first, gloss_side }
}

/// The power is the pull's to say.
fn node_texels(node: &Node) -> [[u32; 4]; NODE_TEXELS] {
    let [x, y, z, radius] = node.centre.extend(node.radius).to_array().map(f32::to_bits);
    let axis = octahedral::pack(node.axis);
    [[x, y, z, radius], [axis, octahedral::widened(node, axis).to_bits(), 0, node.skip]]
}

/// Shapes; the light is the pull's to say.
fn leaf_texels(leaf: &SenderLeaf, row: u32) -> [[u32; 4]; LEAF_TEXELS] {
    let [centre, u, v] = [leaf.centre, leaf.edge_u, leaf.edge_v].map(|vector| vector.to_array().map(f32::to_bits));
    [
        [centre[0], centre[1], centre[2], leaf.is_triangle | row << 1],
        [u[0], u[1], u[2], v[0]],
        [v[1], v[2], 0, 0],
        [0; 4],
    ]
}

/// Right children, and which leaf a leaf is; the shares are the pull's to say.
fn branches(topology: &TreeTopology) -> Vec<[u32; 4]> {
    let nodes = &topology.nodes;
    let branch = |(index, node): (usize, &Node)| match node.skip as usize == index + 1 {
        true => [NO_SENDER, node.leaf, 0, 0],
        false => [nodes[index + 1].skip, 0, 0, 0],
    };
    nodes.iter().enumerate().map(branch).collect()
}
