//! From surfels to winners: links are made, refined and pushed down, window after window.

use super::windows::{self, WindowPlan};
use super::{Footprint, Frames, Settings, bins};
use crate::gpu::shaders::methods::implicit_visibility as passes;
use crate::gpu::shaders::types::{Receiver, WindowLevel};
use crate::gpu::{Buffer, Context, GpuError, Recorder};
use crate::stages::pair_queue::{PairQueue, PairQueueError, PairQueuePlan};
use crate::stages::quadtree::Quadtrees;
use crate::stages::quadtree::topology::QuadtreeTopology;
use crate::stages::work::{Interrupted, Watch};
use glam::{UVec2, Vec3};

/// Pairs of a step of the queue.
const BATCH: u32 = 1 << 16;

/// Why the method cannot be prepared or its links cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum ImplicitError {
    #[error(transparent)]
    Gpu(#[from] GpuError),
    #[error(transparent)]
    Queue(#[from] PairQueueError),
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    #[error(
        "implicit visibility needs {needed} bytes for {elements} elements with {bins} bins each, {available} are \
         available; lower --elements or bins"
    )]
    OutOfMemory { needed: u64, available: u64, elements: u64, bins: u32 },
}

/// What was counted while links were made.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct LinkCounts {
    pub pairs_visited: u64,
    pub pairs_linked: u64,
}

/// The leaves of a window, and the winner of each of their bins.
pub struct Window {
    pub plan: WindowPlan,
    levels: Buffer<WindowLevel>,
    /// `6 n n * leaf_count`, bin after bin: node, and in the highest bit that it turns its back; u32::MAX where empty.
    pub winners: Buffer<u32>,
}

/// Bins, queue and windows.
pub struct Linking {
    pub bin_solid_angles: Buffer<f32>,
    /// Integral of the unit direction over each bin, sr.
    pub bin_vectors: Buffer<Vec3>,
    pub receivers: Buffer<Receiver>,
    pub windows: Vec<Window>,
    keys: Buffer<u64>,
    queue: PairQueue,
}

/// What will be allocated, counted before.
pub(super) struct Sizes {
    pub windows: Vec<WindowPlan>,
    queue: PairQueuePlan,
    keys: usize,
    bytes: u64,
}

impl Sizes {
    pub fn new(context: &Context, trees: &QuadtreeTopology, settings: &Settings) -> Self {
        let bins = u64::from(settings.bin_count());
        let memory = (u64::from(settings.link_memory) << 20).min(context.limits().storage_buffer_bytes);
        let max_rows = (memory / (8 * bins)).clamp(1, 1 << 30) as u32;
        let windows = windows::plan(trees, max_rows);
        let seeds = windows.iter().map(|window| window.receivers.len() * trees.roots.len()).max().unwrap_or(0);
        let levels = 2 * trees.levels.len() as u32;
        let queue = PairQueuePlan { batch: BATCH, max_children: 4, levels, seeds: seeds as u32 };
        let rows = windows.iter().map(WindowPlan::row_count).max().unwrap_or(0);
        let keys = rows as usize * bins as usize;
        let leaves = u64::from(trees.leaf_count());
        let receiver_bytes = leaves * size_of::<Receiver>() as u64;
        let bytes = 8 * keys as u64 + 4 * bins * leaves + queue.bytes_needed() + receiver_bytes;
        Self { windows, queue, keys, bytes }
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
        let n = settings.bins;
        let mut windows = Vec::with_capacity(sizes.windows.len());
        for (index, plan) in sizes.windows.into_iter().enumerate() {
            let count = plan.leaves().len() * settings.bin_count() as usize;
            windows.push(Window {
                levels: context.upload(&format!("implicit/window levels {index}"), &plan.levels)?,
                winners: context.buffer(&format!("implicit/winners {index}"), count)?,
                plan,
            });
        }
        Ok(Self {
            bin_solid_angles: context.upload("implicit/bin solid angles", &bins::solid_angles(n))?,
            bin_vectors: context.upload("implicit/bin vectors", &bins::vectors(n))?,
            receivers: context.buffer("implicit/receivers", trees.topology.leaf_count() as usize)?,
            windows,
            keys: context.buffer("implicit/keys", sizes.keys)?,
            queue: PairQueue::new(context, "implicit", sizes.queue)?,
        })
    }

    /// Makes all links anew for the trees' present surfels.                                   [Dong2007 4.2.2 to 4.2.4]
    pub(super) fn link(
        &self,
        context: &Context,
        trees: &Quadtrees,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> Result<LinkCounts, ImplicitError> {
        let mut counts = LinkCounts::default();
        let window_count = self.windows.len() as u64;
        for (index, window) in self.windows.iter().enumerate() {
            watch.step("links", index as u64, window_count)?;
            let roots = &trees.topology.roots;
            let pairs = window.plan.receivers.iter().flat_map(|&receiver| roots.iter().map(move |&s| (receiver, s)));
            let seeds: Vec<UVec2> = pairs.map(|(receiver, sender)| UVec2::new(receiver, sender)).collect();
            let mut recorder = context.recorder("implicit-visibility")?;
            recorder.fill(&self.keys, u32::MAX);
            recorder.submit()?;
            let pass = passes::Refine {
                taken_pairs: &self.queue.taken,
                counters: &self.queue.counters,
                pair_stack: &self.queue.stack,
                node_segments: &trees.node_segments,
                segments: &trees.segments,
                surfels: &trees.surfels,
                moments: &trees.moments,
                receivers: &self.receivers,
                bin_solid_angles: &self.bin_solid_angles,
                window_levels: &window.levels,
                keys: &self.keys,
                params: passes::RefineParams {
                    n: settings.bins,
                    refinement: if settings.brute_force { 0.0 } else { settings.refinement },
                    is_single: u32::from(settings.footprint() == Footprint::Single),
                    leaf_count: trees.topology.leaf_count(),
                },
            };
            let counters = self.queue.refine(context, "implicit-visibility/create links", &seeds, |recorder| {
                recorder.dispatch_indirect(&pass, &self.queue.groups, 0);
            })?;
            counts.pairs_visited += u64::from(counters.visited);
            counts.pairs_linked += u64::from(counters.accepted);

            let mut recorder = context.recorder("implicit-visibility")?;
            recorder.scope("refine and push", |recorder| self.push_down(recorder, trees, settings, window));
            recorder.submit()?;
        }
        watch.step("links", window_count, window_count)?;
        Ok(counts)
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
            recorder.dispatch(&pass, window.plan.levels[level].count as usize * bin_count as usize);
        }
        let pass = passes::Resolve {
            node_segments: &trees.node_segments,
            segments: &trees.segments,
            window_levels: &window.levels,
            receivers: &self.receivers,
            keys: &self.keys,
            winners: &window.winners,
            params: passes::ResolveParams {
                n: settings.bins,
                fills_holes: u32::from(settings.fill_holes),
                is_turned: u32::from(settings.frames != Frames::World || settings.spin != 0.0),
            },
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
