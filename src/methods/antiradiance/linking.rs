//! What links transfer: sparse rows over (bin, receiver), built on the device.
//!
//! A row is a cell: one bin of one receiver. Rows of one bin and of like length lie side by side in slices ([Kreutzer2014]),
//! so that what threads side by side read lies side by side, and what a bin's rows read of the table stays in caches.
//!
//! [Kreutzer2014]: crate::methods::PAPERS

use super::links::NodeLinks;
use super::{Settings, Tables};
use crate::gpu::shaders::methods::antiradiance as passes;
use crate::gpu::shaders::types::{BinParams, FoundTransfer};
use crate::gpu::{Buffer, Context, GpuError, Recorder, Threads};
use crate::stages::direction_bins::{DeviceBins, Spread};
use crate::stages::hierarchy::{Hierarchy, NONE};
use crate::stages::pair_queue::PairQueueError;
use crate::stages::scan::{self, ScanScratch};
use glam::UVec2;
use std::collections::HashMap;
use std::ops::Range;

/// Cells of a slice and classes of cells by length, in `slices.glsl`; nodes of one workgroup, in its kernels.
const SLICE: u32 = 32;
const LENGTH_CLASSES: usize = 48;
const WORKGROUP_NODES: u32 = 1024;
/// Transfers of a link, both ways, that are kept from counting to filling; where there are more, they are made twice.
const FOUND_A_LINK: u64 = 6;
const TRANSFER_BYTES: u64 = 8;

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
    #[error(
        "{0} transfers are more than can be counted, or one bin's than one buffer holds; lower --elements or raise refinement"
    )]
    TooMany(u64),
}

/// The transfers of consecutive bins.
pub struct TransferWindow {
    pub bins: Range<u32>,
    pub slices: Range<u32>,
    pub first_transfer: u32,
    /// Sender's entry in a table (bin x nodes + node), and the bits of the weight; 0 where a cell has fewer than its slice.
    pub transfers: Buffer<u64>,
}

/// What all links transfer, by bin and receiver.
pub struct Transfers {
    /// Cells with transfers, bin by bin, those with the most first, slice by slice; [`NONE`] fills a bin's last slice.
    pub work: Buffer<u32>,
    /// Where each slice's transfers start over all windows. One entry more.
    pub slice_offsets: Buffer<u32>,
    /// Per cell, `bin x nodes + node`: one beyond the place of its last transfer.
    cells: Buffer<u32>,
    pub windows: Vec<TransferWindow>,
    /// Without what fills slices.
    pub count: u32,
    node_count: u32,
}

/// All transfers as the links gave them, in any order.
struct Found {
    transfers: Buffer<FoundTransfer>,
    count: u32,
}

/// What the kernels that make transfers read.
struct Making<'a> {
    links: &'a NodeLinks,
    hierarchy: &'a Hierarchy,
    bins: &'a DeviceBins,
    cosine_norms: &'a Buffer<f32>,
    params: BinParams,
}

impl Transfers {
    pub fn size_bytes(&self) -> u64 {
        self.work.size_bytes()
            + self.slice_offsets.size_bytes()
            + self.cells.size_bytes()
            + self.windows.iter().map(|w| w.transfers.size_bytes()).sum::<u64>()
    }

    /// Form factors of `links` where their nodes are now: count, sort cells into slices, fill, sort.   [Dachsbacher2007 3.1]
    pub fn new(
        context: &Context,
        links: &NodeLinks,
        hierarchy: &Hierarchy,
        bins: &DeviceBins,
        cosine_norms: &Buffer<f32>,
        settings: &Settings,
        budget: u64,
    ) -> Result<Self, LinkingError> {
        let (node_count, bin_count) = (hierarchy.node_count(), bins.bins.count());
        let params = BinParams {
            side: bins.bins.side,
            count: bin_count,
            class_count: if settings.spread == Spread::None { 0 } else { bins.bins.class_count() },
            is_gaussian: u32::from(settings.spread == Spread::Gaussian),
        };
        let making = Making { links, hierarchy, bins, cosine_norms, params };
        let cells = context.buffer("antiradiance/cells", node_count as usize * bin_count as usize)?;
        let found = making.count(context, &cells, budget.min(context.available_bytes()))?;

        let (counts, class_counts) = count_cells(context, &cells, node_count, bin_count)?;
        let total: u64 = counts.iter().map(|bin| u64::from(bin[LENGTH_CLASSES])).sum();
        // Rather made again than refused.
        let found = found.filter(|found| total * TRANSFER_BYTES + found.transfers.size_bytes() <= budget);
        let available = budget.min(context.available_bytes());
        check_transfers(total, available)?;
        let (bin_slices, starts) = slices_of(&counts);
        let slice_count = bin_slices[bin_count as usize];
        let work = context.buffer("antiradiance/work", (slice_count * SLICE) as usize)?;
        let slice_offsets = context.buffer("antiradiance/slice offsets", slice_count as usize + 1)?;
        context.write(&class_counts, &starts)?;
        list_cells(context, &cells, &class_counts, &work, &slice_offsets, node_count, bin_count)?;

        let mut result = Self { work, slice_offsets, cells, windows: Vec::new(), count: total as u32, node_count };
        let offsets = context.download(&result.slice_offsets)?;
        let padded = u64::from(offsets[slice_count as usize]);
        check_transfers(padded, available)?;
        let ends: Vec<u32> = bin_slices.iter().map(|&slice| offsets[slice as usize]).collect();
        let largest = context.limits().storage_buffer_bytes;
        let table_bins = Tables::window_bins(node_count, settings.half_tables, largest).unwrap_or(bin_count);
        for bins in plan_windows(&ends, largest / TRANSFER_BYTES, table_bins)? {
            let [first, end] = [bins.start, bins.end].map(|bin| ends[bin as usize]);
            let name = format!("antiradiance/transfers {}", result.windows.len());
            let window = TransferWindow {
                slices: bin_slices[bins.start as usize]..bin_slices[bins.end as usize],
                bins,
                first_transfer: first,
                transfers: context.buffer(&name, (end - first) as usize)?,
            };
            making.fill(context, &result, &window, found.as_ref())?;
            result.windows.push(window);
        }
        Ok(result)
    }

    /// Incident from exitant light along all transfers.                       [Dachsbacher2007 4.2, global pass]
    pub fn gather(&self, recorder: &mut Recorder<'_>, tables: &Tables) {
        for table in &tables.windows {
            recorder.fill(&table.incident, 0);
        }
        for window in &self.windows {
            // Windows of transfers lie within those of the tables.
            let Some(table) = tables.windows.iter().find(|table| table.bins.contains(&window.bins.start)) else {
                continue;
            };
            let (first_slice, slice_count) = (window.slices.start, window.slices.len() as u32);
            let pass = passes::Gather {
                slice_offsets: &self.slice_offsets,
                transfers: &window.transfers,
                work: &self.work,
                exitant: &table.exitant,
                incident: &table.incident,
                constants: passes::GatherConstants { words: Tables::words(tables.half) as u32 },
                params: passes::GatherParams {
                    first_slice,
                    slice_count,
                    first_entry: table.bins.start * self.node_count,
                },
            };
            recorder.dispatch(&pass, slice_count * SLICE);
        }
    }

    /// The transfers (sender's entry in a table, weight) of the cells that `cells` has.
    pub fn of_cells(&self, context: &Context, cells: &mut HashMap<u32, Vec<(u32, f32)>>) -> Result<(), GpuError> {
        let (work, ends) = (context.download(&self.work)?, context.download(&self.cells)?);
        let offsets = context.download(&self.slice_offsets)?;
        for window in &self.windows {
            let words = context.download(&window.transfers)?;
            for slot in window.slices.start * SLICE..window.slices.end * SLICE {
                let cell = work[slot as usize];
                let Some(transfers) = cells.get_mut(&cell) else { continue };
                let start = offsets[(slot / SLICE) as usize] + slot % SLICE;
                transfers.extend((start..ends[cell as usize]).step_by(SLICE as usize).map(|place| {
                    let word = words[(place - window.first_transfer) as usize];
                    (word as u32, f32::from_bits((word >> 32) as u32))
                }));
            }
        }
        Ok(())
    }

    /// All transfers: (receiver x bins + bin, sender x bins + bin, weight), in that order.
    pub fn download(&self, context: &Context) -> Result<Vec<(u32, u32, f32)>, GpuError> {
        let work = context.download(&self.work)?;
        let offsets = context.download(&self.slice_offsets)?;
        let ends = context.download(&self.cells)?;
        let bin_count = ends.len() as u32 / self.node_count.max(1);
        let by_node = |entry: u32| entry % self.node_count * bin_count + entry / self.node_count;
        let mut all = Vec::with_capacity(self.count as usize);
        for window in &self.windows {
            let words = context.download(&window.transfers)?;
            for slot in window.slices.start * SLICE..window.slices.end * SLICE {
                let cell = work[slot as usize];
                if cell == NONE {
                    continue;
                }
                let start = offsets[(slot / SLICE) as usize] + slot % SLICE;
                all.extend((start..ends[cell as usize]).step_by(SLICE as usize).map(|place| {
                    let word = words[(place - window.first_transfer) as usize];
                    (by_node(cell), by_node(word as u32), f32::from_bits((word >> 32) as u32))
                }));
            }
        }
        all.sort_unstable_by_key(|&(cell, entry, _)| (cell, entry));
        Ok(all)
    }
}

impl Making<'_> {
    /// Transfers of each cell; and the transfers, where `available` bytes allow.
    fn count(&self, context: &Context, cells: &Buffer<u32>, available: u64) -> Result<Option<Found>, GpuError> {
        let (hierarchy, bins) = (self.hierarchy, self.bins);
        // A quarter at most: the transfers themselves, and all else, come after.
        let room = (available / 4).min(context.limits().storage_buffer_bytes) / size_of::<FoundTransfer>() as u64;
        let capacity = room.min(FOUND_A_LINK * u64::from(self.links.count)) as u32;
        let transfers = context.buffer("antiradiance/found transfers", capacity as usize)?;
        let found_count = context.upload("antiradiance/found count", &[0u32])?;
        let pass_of = |links, link_count| passes::CountTransfers {
            links,
            node_texels: &hierarchy.node_texels,
            cosine_norms: self.cosine_norms,
            bin_directions: &bins.directions,
            spread_offsets: &bins.spread_offsets,
            spread: &bins.spread,
            cells,
            found_count: &found_count,
            found: &transfers,
            params: passes::CountTransfersParams {
                bins: self.params,
                link_count,
                node_count: hierarchy.node_count(),
                capacity,
            },
        };
        let mut recorder = context.recorder("links")?;
        recorder.fill(cells, 0);
        for (links, link_count) in self.links.parts() {
            recorder.dispatch(&pass_of(links, link_count), link_count);
        }
        recorder.submit()?;
        let count = context.download(&found_count)?[0];
        Ok((count <= capacity).then_some(Found { transfers, count }))
    }

    /// The transfers of a window, by rising sender within each cell.
    fn fill(
        &self,
        context: &Context,
        made: &Transfers,
        window: &TransferWindow,
        found: Option<&Found>,
    ) -> Result<(), GpuError> {
        let node_count = self.hierarchy.node_count();
        let slice_count = window.slices.len() as u32;
        let sort = passes::SortTransfers {
            work: &made.work,
            slice_offsets: &made.slice_offsets,
            cells: &made.cells,
            transfers: &window.transfers,
            params: passes::SortTransfersParams { first_slice: window.slices.start, slice_count },
        };
        let mut recorder = context.recorder("links")?;
        recorder.fill(&window.transfers, 0);
        match found {
            None => {
                for (links, link_count) in self.links.parts() {
                    recorder.dispatch(&self.fill_anew(made, window, (links, link_count)), link_count);
                }
            }
            Some(found) => {
                let pass = passes::PlaceTransfers {
                    found: &found.transfers,
                    cells: &made.cells,
                    transfers: &window.transfers,
                    params: passes::PlaceTransfersParams {
                        found_count: found.count,
                        first_cell: window.bins.start * node_count,
                        end_cell: window.bins.end * node_count,
                        first_transfer: window.first_transfer,
                    },
                };
                recorder.dispatch(&pass, found.count);
            }
        }
        recorder.dispatch(&sort, slice_count * SLICE);
        recorder.submit()
    }

    /// The transfers of a window, made from the links once more.
    fn fill_anew<'a>(
        &'a self,
        made: &'a Transfers,
        window: &'a TransferWindow,
        (links, link_count): (&'a Buffer<UVec2>, u32),
    ) -> passes::FillTransfers<'a> {
        let (hierarchy, bins) = (self.hierarchy, self.bins);
        passes::FillTransfers {
            links,
            node_texels: &hierarchy.node_texels,
            cosine_norms: self.cosine_norms,
            bin_directions: &bins.directions,
            spread_offsets: &bins.spread_offsets,
            spread: &bins.spread,
            cells: &made.cells,
            transfers: &window.transfers,
            params: passes::FillTransfersParams {
                bins: self.params,
                link_count,
                node_count: hierarchy.node_count(),
                first_bin: window.bins.start,
                end_bin: window.bins.end,
                first_transfer: window.first_transfer,
            },
        }
    }
}

/// Per bin: cells of each class of length, and transfers; and the device's table of them.
type CellCounts = (Vec<[u32; LENGTH_CLASSES + 1]>, Buffer<u32>);

fn count_cells(
    context: &Context,
    cells: &Buffer<u32>,
    node_count: u32,
    bin_count: u32,
) -> Result<CellCounts, GpuError> {
    let class_counts = context.buffer("antiradiance/class counts", bin_count as usize * (LENGTH_CLASSES + 1))?;
    let mut recorder = context.recorder("links")?;
    recorder.fill(&class_counts, 0);
    let count =
        passes::CountCells { cells, class_counts: &class_counts, params: passes::CountCellsParams { node_count } };
    recorder.dispatch(&count, workgroup_a_bin(node_count, bin_count));
    recorder.submit()?;
    let words = context.download(&class_counts)?;
    Ok((words.as_chunks().0.to_vec(), class_counts))
}

/// A workgroup of 64 threads per [`WORKGROUP_NODES`] nodes and bin.
fn workgroup_a_bin(node_count: u32, bin_count: u32) -> Threads {
    Threads::Grid(64 * node_count.div_ceil(WORKGROUP_NODES), bin_count, 1)
}

/// Cells sorted into slices, how long those are, and where each cell's transfers start (into `cells`).
fn list_cells(
    context: &Context,
    cells: &Buffer<u32>,
    class_counts: &Buffer<u32>,
    work: &Buffer<u32>,
    slice_offsets: &Buffer<u32>,
    node_count: u32,
    bin_count: u32,
) -> Result<(), GpuError> {
    let scratch = ScanScratch::new(context, "antiradiance", slice_offsets.len())?;
    let slot_count = work.len() as u32;
    let mut recorder = context.recorder("links")?;
    recorder.fill(work, NONE);
    let list = passes::ListCells { cells, class_counts, work, params: passes::ListCellsParams { node_count } };
    recorder.dispatch(&list, workgroup_a_bin(node_count, bin_count));
    let slice_count = slot_count / SLICE;
    let measure =
        passes::MeasureSlices { work, cells, slice_offsets, params: passes::MeasureSlicesParams { slice_count } };
    recorder.dispatch(&measure, slice_count);
    scan::exclusive(&mut recorder, slice_offsets, slice_offsets.len(), &scratch);
    let place = passes::PlaceCells { work, slice_offsets, cells, params: passes::PlaceCellsParams { slot_count } };
    recorder.dispatch(&place, slot_count);
    recorder.submit()
}

/// The first slice of each bin and one beyond the last's; and where in the list of cells each class of each bin starts.
fn slices_of(counts: &[[u32; LENGTH_CLASSES + 1]]) -> (Vec<u32>, Vec<u32>) {
    let (mut bin_slices, mut starts) = (vec![0], Vec::with_capacity(counts.len() * (LENGTH_CLASSES + 1)));
    let mut slices = 0;
    for bin in counts {
        let mut next = slices * SLICE;
        for count in &bin[..LENGTH_CLASSES] {
            starts.push(next);
            next += count;
        }
        starts.push(0);
        slices = next.div_ceil(SLICE);
        bin_slices.push(slices);
    }
    (bin_slices, starts)
}

/// Refuses more transfers than can be counted, or than there is memory for.
fn check_transfers(count: u64, available: u64) -> Result<(), LinkingError> {
    // Half of what 32 bits count: slices add less than that.
    if count > u64::from(u32::MAX / 2) {
        return Err(LinkingError::TooMany(count));
    }
    let needed = count * TRANSFER_BYTES;
    if needed > available {
        return Err(LinkingError::OutOfMemory { what: "transfers", needed, available });
    }
    Ok(())
}

/// Ranges of bins whose transfers (`ends`: where each bin's start, one more) fit into `largest`, and whose light lies in one
/// window of the tables, of `table_bins`.
fn plan_windows(ends: &[u32], largest: u64, table_bins: u32) -> Result<Vec<Range<u32>>, LinkingError> {
    let count_of = |bins: &Range<u32>| u64::from(ends[bins.end as usize] - ends[bins.start as usize]);
    let bin_count = ends.len() as u32 - 1;
    let (mut windows, mut first) = (Vec::new(), 0);
    while first < bin_count {
        let mut own = first..first + 1;
        if count_of(&own) > largest {
            return Err(LinkingError::TooMany(count_of(&own)));
        }
        let table_end = (first / table_bins + 1).saturating_mul(table_bins).min(bin_count);
        while own.end < table_end && count_of(&(first..own.end + 1)) <= largest {
            own.end += 1;
        }
        first = own.end;
        windows.push(own);
    }
    Ok(windows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_and_windows_end_with_bins() {
        let mut counts = [[0; LENGTH_CLASSES + 1]; 3];
        (counts[0][0], counts[0][5], counts[2][1]) = (33, 40, 1);
        let (bin_slices, starts) = slices_of(&counts);
        assert_eq!(bin_slices, [0, 3, 3, 4]);
        assert_eq!((starts[0], starts[1], starts[5], starts[6]), (0, 33, 33, 73));
        assert_eq!(starts[2 * (LENGTH_CLASSES + 1) + 1], 3 * SLICE);
        assert_eq!(plan_windows(&[0, 10, 20, 45], 25, 8).unwrap(), [0..2, 2..3]);
        assert_eq!(plan_windows(&[0, 10, 20, 45, 50], 100, 2).unwrap(), [0..2, 2..4]);
        assert_eq!(plan_windows(&[0, 10, 20, 45], 100, u32::MAX).unwrap(), vec![0..3]);
        assert!(matches!(plan_windows(&[0, 10, 20, 45], 24, 8), Err(LinkingError::TooMany(25))));
    }
}
