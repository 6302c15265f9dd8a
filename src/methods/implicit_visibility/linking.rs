//! From surfels to winners: links are made, refined and pushed down, window after window.

use super::windows::{self, WindowPlan};
use super::{Footprint, Frames, Settings, bins};
use crate::gpu::shaders::methods::implicit_visibility as passes;
use crate::gpu::shaders::types::{GroupWalk, LinkCounts, Receiver, ReceiverGroup, WindowLevel};
use crate::gpu::{Buffer, Context, GpuError, Recorder, TexelBuffer};
use crate::stages::elements::Elements;
use crate::stages::hidden_parts::HiddenPartsError;
use crate::stages::quadtree::Quadtrees;
use crate::stages::quadtree::topology::QuadtreeTopology;
use crate::stages::work::{Interrupted, Watch};
use crate::stages::world::World;
use glam::Vec3;
use std::ops::Range;

/// Groups of receivers whose links are made together, and submitted at once: between them the user may interrupt.
const GROUPS_AT_ONCE: u64 = 1 << 11;
/// Threads of a group's workgroup.
const LINKERS: u32 = 64;
/// Senders of each kind that a group holds before they are linked.
const CAPACITY: u32 = 1 << 10;
/// Kinds of senders, in the order of `lib/bins.glsl`: leaves, flat ones, nodes about a plane, nodes without one.
const KINDS: u32 = 4;
/// Texels of a node as sender and as receiver; the layout is that of `link_texels.glsl`.
const SENDER_TEXELS: usize = 5;
const RECEIVER_TEXELS: usize = 3;
/// Threads per node that push links down.
const PUSHERS: usize = 16;

/// Why the method cannot be prepared or its links cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum ImplicitError {
    #[error(transparent)]
    Gpu(#[from] GpuError),
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    #[error(transparent)]
    HiddenParts(#[from] HiddenPartsError),
    #[error(
        "walks over the trees did not end in {rounds} rounds: the device computes wrongly; try --validate, or another --gpu"
    )]
    Endless { rounds: u32 },
    #[error(
        "implicit visibility needs {needed} bytes for {elements} elements with {bins} bins each, {available} are \
         available; lower --elements or bins"
    )]
    OutOfMemory { needed: u64, available: u64, elements: u64, bins: u32 },
    #[error(
        "implicit visibility needs {needed} bytes for the directions of {nodes} glossy nodes, {available} are available; \
         lower glossy_bins or raise glossy"
    )]
    GlossOutOfMemory { needed: u64, available: u64, nodes: usize },
}

/// The leaves of a window, and the winner of each of their bins.
pub struct Window {
    pub plan: WindowPlan,
    levels: Buffer<WindowLevel>,
    /// Of all levels, leaves first.
    groups: Buffer<ReceiverGroup>,
    /// `6 n n * leaf_count`, bin after bin: node, and in the highest bit that it turns its back; u32::MAX where empty.
    pub winners: Buffer<u32>,
    /// `ceil(6 n n / 32) * leaf_count`, bits: the bins whose winners emit, each leaf's light links.
    pub light_bins: Buffer<u32>,
}

/// Bins, queue and windows.
pub struct Linking {
    pub bin_solid_angles: Buffer<f32>,
    /// Integral of the unit direction over each bin, sr.
    pub bin_vectors: Buffer<Vec3>,
    pub receivers: Buffer<Receiver>,
    /// What links are made from, of all nodes.
    sender_texels: TexelBuffer,
    receiver_texels: TexelBuffer,
    pub windows: Vec<Window>,
    /// Of the window linked last: of each node and bin, distance bits above, back and node below.
    pub keys: Buffer<u64>,
    /// One entry.
    pub counts: Buffer<LinkCounts>,
    /// Of the groups at work: where their walks are, and the senders that they hold, [`CAPACITY`] of each kind.
    group_walks: Buffer<GroupWalk>,
    held_senders: Buffer<u32>,
    /// One entry; not zero where a walk has to go on.
    unfinished: Buffer<u32>,
}

/// What will be allocated, counted before.
pub(super) struct Sizes {
    pub windows: Vec<WindowPlan>,
    keys: usize,
    /// Groups at work, at most.
    groups: usize,
    bytes: u64,
}

impl Sizes {
    pub fn new(context: &Context, trees: &QuadtreeTopology, settings: &Settings) -> Self {
        let bins = u64::from(settings.bin_count());
        let memory = (u64::from(settings.link_memory) << 20).min(context.limits().storage_buffer_bytes);
        let max_rows = (memory / (8 * bins)).clamp(1, 1 << 30) as u32;
        let windows = windows::plan(trees, max_rows);
        let rows = windows.iter().map(WindowPlan::row_count).max().unwrap_or(0);
        let keys = rows as usize * bins as usize;
        let leaves = u64::from(trees.leaf_count());
        let node_bytes = 16 * (SENDER_TEXELS + RECEIVER_TEXELS) as u64 * u64::from(trees.node_count());
        let receiver_bytes = leaves * size_of::<Receiver>() as u64 + node_bytes;
        let most_groups = windows.iter().map(|window| window.groups.iter().map(Vec::len).sum::<usize>()).max();
        // All that they hold is one binding.
        let group_bytes = u64::from(4 * KINDS * CAPACITY);
        let at_once = (context.limits().storage_buffer_bytes / group_bytes).clamp(1, GROUPS_AT_ONCE);
        let groups = most_groups.unwrap_or(0).min(at_once as usize);
        let held_bytes = groups as u64 * (group_bytes + size_of::<GroupWalk>() as u64);
        let bytes = 8 * keys as u64 + 4 * (bins + bins.div_ceil(32)) * leaves + receiver_bytes + held_bytes;
        Self { windows, keys, groups, bytes }
    }

    /// Bytes that [`Linking::new`] allocates.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }
}

impl Linking {
    pub(super) fn new(
        context: &Context,
        trees: &Quadtrees,
        settings: &Settings,
        sizes: Sizes,
    ) -> Result<Self, GpuError> {
        let (n, nodes) = (settings.bins, trees.topology.node_count() as usize);
        let mut windows = Vec::with_capacity(sizes.windows.len());
        for (index, plan) in sizes.windows.into_iter().enumerate() {
            let count = plan.leaves().len() * settings.bin_count() as usize;
            windows.push(Window {
                levels: context.upload(&format!("implicit/window levels {index}"), &plan.levels)?,
                groups: context.upload(&format!("implicit/receiver groups {index}"), &plan.groups.concat())?,
                winners: context.buffer(&format!("implicit/winners {index}"), count)?,
                light_bins: context.buffer(
                    &format!("implicit/light bins {index}"),
                    plan.leaves().len() * settings.bin_count().div_ceil(32) as usize,
                )?,
                plan,
            });
        }
        Ok(Self {
            bin_solid_angles: context.upload("implicit/bin solid angles", &bins::solid_angles(n))?,
            bin_vectors: context.upload("implicit/bin vectors", &bins::vectors(n))?,
            receivers: context.buffer("implicit/receivers", trees.topology.leaf_count() as usize)?,
            sender_texels: context.texel_buffer("implicit/sender texels", (SENDER_TEXELS * nodes).max(1))?,
            receiver_texels: context.texel_buffer("implicit/receiver texels", (RECEIVER_TEXELS * nodes).max(1))?,
            windows,
            keys: context.buffer("implicit/keys", sizes.keys)?,
            counts: context.buffer("implicit/link counts", 1)?,
            group_walks: context.buffer("implicit/group walks", sizes.groups)?,
            held_senders: context.buffer("implicit/held senders", sizes.groups * (KINDS * CAPACITY) as usize)?,
            unfinished: context.buffer("implicit/unfinished walks", 1)?,
        })
    }

    /// Makes all links anew for the trees' present surfels; says how many pairs were visited and how many links
    /// proposed.                                                                           [Dong2007 4.2.2 to 4.2.4]
    pub(super) fn link(
        &self,
        context: &Context,
        trees: &Quadtrees,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> Result<(u64, u64), ImplicitError> {
        let (mut visited, mut proposed) = (0, 0);
        let rows: u64 = self.windows.iter().map(|window| u64::from(window.plan.row_count())).sum();
        let mut done = 0;
        for window in &self.windows {
            let mut recorder = context.recorder("implicit-visibility")?;
            recorder.fill(&self.keys, u32::MAX);
            recorder.fill(&self.counts, 0);
            recorder.submit()?;
            let mut first_group = 0;
            for groups in window.plan.groups.concat().chunks(self.group_walks.len().max(1)) {
                let group_count = groups.len() as u32;
                // Walks with more senders than a group holds take several rounds, and a walk that stops has filled a list.
                let most_rounds = trees.topology.node_count() / CAPACITY + 1;
                let mut rounds = 0;
                while rounds == 0 || context.download(&self.unfinished)?[0] != 0 {
                    watch.step("links", done, rows)?;
                    if rounds == most_rounds {
                        return Err(ImplicitError::Endless { rounds });
                    }
                    let mut recorder = context.recorder("implicit-visibility")?;
                    recorder.scope("create links", |recorder| {
                        self.create_links(
                            recorder,
                            trees,
                            window,
                            settings,
                            first_group..first_group + group_count,
                            rounds == 0,
                        );
                    });
                    recorder.submit()?;
                    rounds += 1;
                }
                done += groups.iter().map(|group| u64::from(group.count)).sum::<u64>();
                first_group += group_count;
            }
            let mut recorder = context.recorder("implicit-visibility")?;
            recorder.scope("refine and push", |recorder| self.push_down(recorder, trees, settings, window));
            recorder.submit()?;
            let counts = context.download(&self.counts)?[0];
            visited += u64::from(counts.visited);
            proposed += u64::from(counts.proposed);
        }
        watch.step("links", rows, rows)?;
        Ok((visited, proposed))
    }

    /// Collects senders for the groups as far as these can hold them, and links them.
    fn create_links(
        &self,
        recorder: &mut Recorder<'_>,
        trees: &Quadtrees,
        window: &Window,
        settings: &Settings,
        groups: Range<u32>,
        is_start: bool,
    ) {
        let (first_group, group_count) = (groups.start, groups.len() as u32);
        let leaf_count = trees.topology.leaf_count();
        recorder.fill(&self.unfinished, 0);
        let pass = passes::CollectSenders {
            walk_texels: &trees.walk_texels,
            surfels: &trees.surfels,
            receiver_groups: &window.groups,
            group_walks: &self.group_walks,
            held_senders: &self.held_senders,
            link_counts: &self.counts,
            unfinished: &self.unfinished,
            params: passes::CollectSendersParams {
                first_group,
                group_count,
                n: settings.bins,
                refinement: if settings.brute_force { 0.0 } else { settings.refinement },
                leaf_count,
                walk_count: trees.topology.node_count(),
                capacity: CAPACITY,
                is_start: u32::from(is_start),
            },
        };
        recorder.dispatch(&pass, group_count);
        for kind in 0..KINDS {
            let pass = passes::CreateLinks {
                receiver_groups: &window.groups,
                sender_texels: &self.sender_texels,
                receiver_texels: &self.receiver_texels,
                corner_texels: &trees.corner_texels,
                group_walks: &self.group_walks,
                held_senders: &self.held_senders,
                keys: &self.keys,
                link_counts: &self.counts,
                constants: passes::CreateLinksConstants {
                    kind,
                    is_single: u32::from(settings.footprint() == Footprint::Single),
                    is_turned: u32::from(settings.is_turned()),
                },
                params: passes::CreateLinksParams { first_group, group_count, n: settings.bins, capacity: CAPACITY },
            };
            recorder.dispatch(&pass, LINKERS * group_count);
        }
    }

    /// Where leaves receive, and all nodes laid out for links, once surfels are pulled.          [Dong2007 4.2.1]
    pub(super) fn place(
        &self,
        recorder: &mut Recorder<'_>,
        world: &World,
        elements: &Elements,
        trees: &Quadtrees,
        settings: &Settings,
    ) {
        let (leaf_count, node_count) = (trees.topology.leaf_count(), trees.topology.node_count());
        let pass = passes::Receivers {
            leaf_elements: &trees.leaf_elements,
            ray_origins: &elements.ray_origins,
            element_normals: &elements.normals,
            element_vertices: &elements.vertices,
            positions: &world.positions,
            triangles: &world.triangles,
            incident_offsets: &elements.incident_offsets,
            incident_triangles: &elements.incident_triangles,
            receivers: &self.receivers,
            params: passes::ReceiversParams {
                leaf_count,
                follows_surface: u32::from(settings.frames == Frames::Surface),
                spin: settings.spin.to_radians(),
            },
        };
        recorder.dispatch(&pass, leaf_count);
        let pass = passes::PackNodes {
            surfels: &trees.surfels,
            moments: &trees.moments,
            leaf_cells: &trees.leaf_cells,
            receivers: &self.receivers,
            node_segments: &trees.node_segments,
            segments: &trees.segments,
            sender_texels: self.sender_texels.buffer(),
            receiver_texels: self.receiver_texels.buffer(),
            params: passes::PackNodesParams { node_count, leaf_count },
        };
        recorder.dispatch(&pass, node_count);
    }

    fn push_down(&self, recorder: &mut Recorder<'_>, trees: &Quadtrees, settings: &Settings, window: &Window) {
        let bin_count = settings.bin_count();
        for level in (1..trees.topology.levels.len()).rev() {
            let pass = passes::PushDown {
                node_segments: &trees.node_segments,
                segments: &trees.segments,
                window_levels: &window.levels,
                keys: &self.keys,
                params: passes::PushDownParams { level: level as u32, bin_count },
            };
            recorder.dispatch(&pass, window.plan.levels[level].count as usize * PUSHERS);
        }
        recorder.fill(&window.winners, u32::MAX);
        let pass = passes::Resolve {
            node_segments: &trees.node_segments,
            segments: &trees.segments,
            window_levels: &window.levels,
            receivers: &self.receivers,
            keys: &self.keys,
            winners: &window.winners,
            constants: passes::ResolveConstants { is_turned: u32::from(settings.is_turned()) },
            params: passes::ResolveParams { n: settings.bins, fills_holes: u32::from(settings.fill_holes) },
        };
        recorder.dispatch(&pass, window.plan.leaves().len() * 6 * settings.bins as usize);
    }

    /// The winners of one leaf's bins, for views and tests.
    pub fn winners_of(&self, context: &Context, leaf: u32) -> Result<Vec<u32>, GpuError> {
        for window in &self.windows {
            let leaves = window.plan.leaves();
            if leaves.contains(&leaf) {
                let all = context.download(&window.winners)?;
                return Ok(all.iter().copied().skip((leaf - leaves.start) as usize).step_by(leaves.len()).collect());
            }
        }
        Ok(Vec::new())
    }
}
