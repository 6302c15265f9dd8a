//! Links between nodes, and what they transfer: sparse rows over (receiver, bin), built on the device.

use super::{Settings, Tables};
use crate::gpu::shaders::methods::antiradiance as passes;
use crate::gpu::shaders::types::{BinParams, PairCounters};
use crate::gpu::{Buffer, Context, GpuError, Recorder};
use crate::stages::direction_bins::{DeviceBins, Spread};
use crate::stages::hierarchy::Hierarchy;
use crate::stages::pair_queue::{PairQueue, PairQueueError, PairQueuePlan};
use crate::stages::scan::{self, ScanScratch};
use glam::UVec2;
use std::f32::consts::PI;
use std::ops::Range;

/// Pairs of one step of the queue.
const QUEUE_BATCH: u32 = 8192;
/// Classes of cells by length, and cells of one workgroup, in `work_classes.glsl` and its kernels.
const WORK_CLASSES: usize = 16;
const WORK_CELLS: u32 = 1024;
/// Links a leaf that a first attempt has room for.
const FIRST_GUESS: u64 = 64;

/// Why links cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum LinkingError {
    #[error(transparent)]
    Gpu(#[from] GpuError),
    #[error(transparent)]
    Queue(#[from] PairQueueError),
    #[error(
        "{what} need {needed} bytes, {available} are available; lower --elements or bins, or raise refinement \
         (coarser links)"
    )]
    OutOfMemory { what: &'static str, needed: u64, available: u64 },
    #[error("{0} transfers are more than 32 bits can count; lower --elements or bins, or raise refinement")]
    TooMany(u64),
}

/// Pairs of nodes that exchange light, in no order.
pub struct NodeLinks {
    /// `count` are in use.
    pub pairs: Buffer<UVec2>,
    pub count: u32,
    /// What the queue counted.
    pub counters: PairCounters,
}

impl NodeLinks {
    /// Refines from the root's link to itself.                                     [Dachsbacher2007 3.2]
    pub fn refine(
        context: &Context,
        hierarchy: &Hierarchy,
        solid_angle: f32,
        budget: u64,
    ) -> Result<Self, LinkingError> {
        // A node of four children with itself: six pairs and four selves.
        let mut plan =
            PairQueuePlan { batch: QUEUE_BATCH, max_children: 10, levels: 2 * hierarchy.plan.depth() + 1, seeds: 1 };
        while plan.bytes_needed() > context.limits().storage_buffer_bytes && plan.batch > 1 {
            plan.batch /= 2;
        }
        let queue = PairQueue::new(context, "antiradiance", plan)?;
        let link_bytes = size_of::<UVec2>() as u64;
        let available = budget.min(context.limits().storage_buffer_bytes);
        let mut capacity = (FIRST_GUESS * u64::from(hierarchy.leaf_count())).max(1024).min(available / link_bytes);
        let seeds: &[UVec2] = if hierarchy.node_count() > 0 { &[UVec2::ZERO] } else { &[] };
        loop {
            let pairs = context.buffer("antiradiance/links", capacity as usize)?;
            let counters = queue.refine(context, "links", seeds, |recorder| {
                let pass = passes::RefineLinks {
                    nodes: &hierarchy.nodes,
                    taken_pairs: &queue.taken,
                    counters: &queue.counters,
                    pair_stack: &queue.stack,
                    links: &pairs,
                    params: passes::RefineLinksParams { solid_angle, capacity: capacity as u32 },
                };
                recorder.dispatch_indirect(&pass, &queue.groups, 0);
            })?;
            let needed = u64::from(counters.accepted);
            if needed <= capacity {
                return Ok(Self { pairs, count: counters.accepted, counters });
            }
            if needed * link_bytes > available {
                return Err(LinkingError::OutOfMemory { what: "links", needed: needed * link_bytes, available });
            }
            capacity = needed;
        }
    }
}

/// The transfers of consecutive receivers.
pub struct TransferWindow {
    pub first_node: u32,
    pub node_count: u32,
    pub first_transfer: u32,
    pub count: u32,
    /// Sender's entry in a table (node x bins + bin), and the bits of the weight.
    pub transfers: Buffer<u64>,
    /// Cells with transfers, those with the most first.
    pub work: Buffer<u32>,
}

/// Receivers of a window and its place among all transfers.
type NodesAndTransfers = (Range<u32>, Range<u32>);

/// What all links transfer, by receiver and bin.
pub struct Transfers {
    /// End of each cell over all windows: cell = node x bins + bin. One entry more.
    pub cell_offsets: Buffer<u32>,
    pub windows: Vec<TransferWindow>,
    pub count: u32,
}

impl Transfers {
    pub fn size_bytes(&self) -> u64 {
        self.cell_offsets.size_bytes()
            + self.windows.iter().map(|w| w.transfers.size_bytes() + w.work.size_bytes()).sum::<u64>()
    }

    /// Form factors of `links` where their nodes are now: count, prefix sum, fill, sort.       [Dachsbacher2007 3.1]
    pub fn new(
        context: &Context,
        links: &NodeLinks,
        hierarchy: &Hierarchy,
        bins: &DeviceBins,
        cosine_norms: &Buffer<f32>,
        settings: &Settings,
        budget: u64,
    ) -> Result<Self, LinkingError> {
        let bin_count = bins.bins.count();
        let cells = hierarchy.node_count() as usize * bin_count as usize;
        let cell_offsets = context.buffer("antiradiance/cell offsets", cells + 1)?;
        let bin_params = BinParams {
            side: bins.bins.side,
            count: bin_count,
            class_count: if settings.spread == Spread::None { 0 } else { bins.bins.class_count() },
            is_gaussian: u32::from(settings.spread == Spread::Gaussian),
        };
        let mut recorder = context.recorder("links")?;
        recorder.fill(&cell_offsets, 0);
        let count = passes::CountTransfers {
            links: &links.pairs,
            nodes: &hierarchy.nodes,
            leaves: &hierarchy.leaves,
            bin_directions: &bins.directions,
            spread_offsets: &bins.spread_offsets,
            spread: &bins.spread,
            cell_offsets: &cell_offsets,
            params: passes::CountTransfersParams { bins: bin_params, link_count: links.count },
        };
        recorder.dispatch(&count, links.count);
        let scratch = ScanScratch::new(context, "antiradiance", cells + 1)?;
        scan::exclusive(&mut recorder, &cell_offsets, cells + 1, &scratch);
        recorder.submit()?;
        let total = context.download_range(&cell_offsets, cells..cells + 1)?[0];

        let mut result = Self { cell_offsets, windows: Vec::new(), count: total };
        let needed = u64::from(total) * size_of::<u64>() as u64;
        let available = budget.min(context.available_bytes());
        if needed > available {
            return Err(LinkingError::OutOfMemory { what: "transfers", needed, available });
        }
        for (nodes, transfers) in result.plan_windows(context, hierarchy.node_count(), bin_count)? {
            let name = format!("antiradiance/transfers {}", result.windows.len());
            let mut window = TransferWindow {
                first_node: nodes.start,
                node_count: nodes.len() as u32,
                first_transfer: transfers.start,
                count: transfers.len() as u32,
                transfers: context.buffer(&name, transfers.len())?,
                work: context.buffer("antiradiance/no work", 0)?,
            };
            let fill = passes::FillTransfers {
                links: &links.pairs,
                nodes: &hierarchy.nodes,
                leaves: &hierarchy.leaves,
                cosine_norms,
                bin_directions: &bins.directions,
                spread_offsets: &bins.spread_offsets,
                spread: &bins.spread,
                cell_offsets: &result.cell_offsets,
                transfers: &window.transfers,
                params: passes::FillTransfersParams {
                    bins: bin_params,
                    link_count: links.count,
                    first_receiver: nodes.start,
                    end_receiver: nodes.end,
                    first_transfer: transfers.start,
                },
            };
            let mut recorder = context.recorder("links")?;
            recorder.dispatch(&fill, links.count);
            let sort = passes::SortTransfers {
                cell_offsets: &result.cell_offsets,
                transfers: &window.transfers,
                params: passes::SortTransfersParams {
                    first_cell: nodes.start * bin_count,
                    cell_count: nodes.len() as u32 * bin_count,
                    first_transfer: transfers.start,
                },
            };
            recorder.dispatch(&sort, nodes.len() * bin_count as usize);
            recorder.submit()?;
            window.work = result.list_work(context, nodes.start * bin_count, nodes.len() as u32 * bin_count)?;
            result.windows.push(window);
        }
        Ok(result)
    }

    /// The cells with transfers, the longest first: threads side by side then have as much to do.
    fn list_work(&self, context: &Context, first_cell: u32, cell_count: u32) -> Result<Buffer<u32>, GpuError> {
        let class_counts = context.upload("antiradiance/work classes", &[0u32; WORK_CLASSES])?;
        let threads = cell_count.div_ceil(WORK_CELLS) * passes::CountWork::PROGRAM.workgroup[0];
        let mut recorder = context.recorder("links")?;
        let count = passes::CountWork {
            cell_offsets: &self.cell_offsets,
            class_counts: &class_counts,
            params: passes::CountWorkParams { first_cell, cell_count },
        };
        recorder.dispatch(&count, threads);
        recorder.submit()?;
        let counts = context.download(&class_counts)?;
        let (mut total, mut starts) = (0, Vec::with_capacity(WORK_CLASSES));
        for count in counts {
            starts.push(total);
            total += count;
        }
        context.write(&class_counts, &starts)?;
        let work = context.buffer("antiradiance/work", total as usize)?;
        let mut recorder = context.recorder("links")?;
        let list = passes::ListWork {
            cell_offsets: &self.cell_offsets,
            class_counts: &class_counts,
            work: &work,
            params: passes::ListWorkParams { first_cell, cell_count },
        };
        recorder.dispatch(&list, threads);
        recorder.submit()?;
        Ok(work)
    }

    /// Ranges of (receivers, transfers), none larger than a pass can bind.
    fn plan_windows(
        &self,
        context: &Context,
        node_count: u32,
        bin_count: u32,
    ) -> Result<Vec<NodesAndTransfers>, LinkingError> {
        let largest = context.limits().storage_buffer_bytes / size_of::<u64>() as u64;
        if u64::from(self.count) <= largest {
            return Ok(vec![(0..node_count, 0..self.count)]);
        }
        let offsets = context.download(&self.cell_offsets)?;
        let start_of = |node: u32| offsets[node as usize * bin_count as usize];
        let (mut windows, mut first) = (Vec::new(), 0);
        while first < node_count {
            let mut end = first + 1;
            while end < node_count && u64::from(start_of(end + 1) - start_of(first)) <= largest {
                end += 1;
            }
            let own = u64::from(start_of(end) - start_of(first));
            if own > largest {
                return Err(LinkingError::TooMany(own));
            }
            windows.push((first..end, start_of(first)..start_of(end)));
            first = end;
        }
        Ok(windows)
    }

    /// `incident` from `exitant` along all transfers.                       [Dachsbacher2007 4.2, global pass]
    pub fn gather(&self, recorder: &mut Recorder<'_>, half: bool, exitant: &Buffer<u64>, incident: &Buffer<u64>) {
        recorder.fill(incident, 0);
        for window in &self.windows {
            let work_count = window.work.len() as u32;
            let pass = passes::Gather {
                cell_offsets: &self.cell_offsets,
                transfers: &window.transfers,
                work: &window.work,
                exitant,
                incident,
                constants: passes::GatherConstants { words: Tables::words(half) as u32 },
                params: passes::GatherParams { work_count, first_transfer: window.first_transfer },
            };
            recorder.dispatch(&pass, work_count);
        }
    }

    /// All transfers: (receiver's cell, sender's entry, weight), in order of cells.
    pub fn download(&self, context: &Context) -> Result<Vec<(u32, u32, f32)>, GpuError> {
        let ends = context.download(&self.cell_offsets)?;
        let mut words = Vec::with_capacity(self.count as usize);
        for window in &self.windows {
            words.extend(context.download(&window.transfers)?);
        }
        let mut first = 0;
        let mut all = Vec::with_capacity(words.len());
        for (cell, &end) in ends.iter().take(ends.len() - 1).enumerate() {
            all.extend((first..end).map(|k| {
                let word = words[k as usize];
                (cell as u32, word as u32, f32::from_bits((word >> 32) as u32))
            }));
            first = end;
        }
        Ok(all)
    }
}

/// Solid angle that a node of a link may have, of a bin's.
pub fn link_solid_angle(settings: &Settings) -> f32 {
    settings.refinement * 4.0 * PI / settings.bins.get() as f32
}
