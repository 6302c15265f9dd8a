//! Links in compressed sparse rows: built on the device from the hits of each receiver's rays, batch after batch.
//!
//! Row `r` holds the links of receiver `r`, sorted by sender, each sender once; weights are form factors from receiver
//! to sender. The list is cut into windows of whole rows, none larger than a pass can bind. What it does not do: cast
//! rays ([`super::trace`]) or send light ([`super::gather`]).

use super::scan::{self, ScanScratch};
use crate::gpu::shaders::links as passes;
use crate::gpu::shaders::types::{Hit, Link, RowEntry};
use crate::gpu::{Buffer, Context, GpuError, Recorder};
use glam::UVec3;
use std::ops::Range;

/// Elements that a packed link can name.
pub const PACKED_ELEMENTS: u32 = 1 << 20;
/// Units of the weight of one packed link.
const PACKED_UNITS: u32 = 4096;
/// Units of one ray; the same constant stands in `lib/link.glsl`.
const RAY_UNITS: u32 = 1 << 16;
/// Rays per element that fit the workgroup memory of the merge.
pub const MAX_RAYS: u32 = 1024;

/// How a link is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinkFormat {
    /// Sender and f32 weight, 8 bytes.
    Full,
    /// 20 bits of sender and 12 of weight, 4 bytes. A weight is off by 1/4096 at most; sums of rows are kept.
    Packed,
}

/// Why links cannot be built.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    #[error(transparent)]
    Gpu(#[from] GpuError),
    #[error(
        "links need about {needed} bytes ({per_element:.0} links an element, as counted on the first {counted} of \
         {element_count}), {available} are available; lower --elements or rays_per_element, or set packed_links=true"
    )]
    OutOfMemory { needed: u64, available: u64, per_element: f64, counted: u32, element_count: u32 },
    #[error("packed links name at most {PACKED_ELEMENTS} elements, this scene has {0}; set packed_links=false")]
    TooManyForPacked(u32),
    #[error("{0} links are more than 32 bits can count; lower --elements or rays_per_element")]
    TooMany(u64),
}

/// The links of some consecutive receivers.
pub struct LinkWindow {
    pub first_element: u32,
    pub element_count: u32,
    /// Links of the windows before.
    pub first_link: u32,
    pub link_count: u32,
    pub table: LinkTable,
}

/// The links themselves; some room may be left at the end.
pub enum LinkTable {
    Full(Buffer<Link>),
    Packed(Buffer<u32>),
}

impl LinkTable {
    fn new(context: &Context, format: LinkFormat, index: usize, capacity: usize) -> Result<Self, GpuError> {
        let name = format!("links/window {index}");
        Ok(match format {
            LinkFormat::Full => Self::Full(context.buffer(&name, capacity)?),
            LinkFormat::Packed => Self::Packed(context.buffer(&name, capacity)?),
        })
    }

    /// Links that fit.
    pub fn capacity(&self) -> usize {
        match self {
            Self::Full(table) => table.len(),
            Self::Packed(table) => table.len(),
        }
    }

    pub fn size_bytes(&self) -> u64 {
        match self {
            Self::Full(table) => table.size_bytes(),
            Self::Packed(table) => table.size_bytes(),
        }
    }
}

/// All links of a scene.
pub struct Links {
    pub format: LinkFormat,
    /// `element_count + 1` entries over all windows, the first 0.
    pub offsets: Buffer<u32>,
    /// In order of receivers, without gaps.
    pub windows: Vec<LinkWindow>,
    pub element_count: u32,
    pub link_count: u32,
}

impl Links {
    /// Bytes allocated.
    pub fn size_bytes(&self) -> u64 {
        self.offsets.size_bytes() + self.windows.iter().map(|w| w.table.size_bytes()).sum::<u64>()
    }
}

/// What the rays of each element met, beside links.
pub struct Outcomes {
    /// A bit per element and ray that met nothing; each element starts a word.
    pub escaped: Buffer<u32>,
    /// Per element: rays blocked by a back face, and in the upper half escaped ones.
    pub counts: Buffer<u32>,
}

impl Outcomes {
    pub fn new(context: &Context, element_count: u32, ray_count: u32) -> Result<Self, GpuError> {
        let words = element_count as usize * ray_count.div_ceil(32) as usize;
        Ok(Self {
            escaped: context.buffer("links/escaped rays", words)?,
            counts: context.buffer("links/ray outcomes", element_count as usize)?,
        })
    }
}

/// Builds [`Links`] from batches of hits, in order of elements: [`Self::merge`], submit, [`Self::append`].
pub struct LinkBuilder<'c> {
    context: &'c Context,
    element_count: u32,
    ray_count: u32,
    budget: u64,
    /// `batch_capacity` rows of `3 * ray_count`.
    row_entries: Buffer<RowEntry>,
    /// `batch_capacity + 1`; counts, then offsets within the batch.
    row_counts: Buffer<u32>,
    scan: ScanScratch,
    links: Links,
}

impl<'c> LinkBuilder<'c> {
    /// Scratch bytes per element of a batch.
    pub fn batch_bytes(ray_count: u32) -> u64 {
        u64::from(3 * ray_count) * size_of::<RowEntry>() as u64
    }

    /// `budget`: bytes that links may take. `ray_count` is at most [`MAX_RAYS`].
    pub fn new(
        context: &'c Context,
        format: LinkFormat,
        element_count: u32,
        ray_count: u32,
        batch_capacity: u32,
        budget: u64,
    ) -> Result<Self, LinkError> {
        if format == LinkFormat::Packed && element_count > PACKED_ELEMENTS {
            return Err(LinkError::TooManyForPacked(element_count));
        }
        let rows = batch_capacity as usize;
        Ok(Self {
            context,
            element_count,
            ray_count,
            budget,
            row_entries: context.buffer("links/row entries", rows * 3 * ray_count as usize)?,
            row_counts: context.buffer("links/row counts", rows + 1)?,
            scan: ScanScratch::new(context, "links", rows + 1)?,
            links: Links {
                format,
                offsets: context.upload("links/offsets", &vec![0; element_count as usize + 1])?,
                windows: Vec::new(),
                element_count,
                link_count: 0,
            },
        })
    }

    /// Turns the hits of the elements of `batch` into rows.
    pub fn merge(
        &self,
        recorder: &mut Recorder<'_>,
        batch: Range<u32>,
        hits: &Buffer<Hit>,
        triangles: &Buffer<UVec3>,
        back_elements: &Buffer<u32>,
        outcomes: &Outcomes,
    ) {
        let batch_count = batch.len() as u32;
        let pass = passes::MergeHits {
            hits,
            triangles,
            back_elements,
            row_entries: &self.row_entries,
            row_counts: &self.row_counts,
            escaped: &outcomes.escaped,
            outcomes: &outcomes.counts,
            // As many buckets as fit in 32 KiB beside the table of 1024 rays.
            constants: passes::MergeHitsConstants {
                rays: self.ray_count,
                buckets: if self.ray_count > 576 { 256 } else { 1024 },
            },
            params: passes::MergeHitsParams {
                first_element: batch.start,
                batch_count,
                element_count: self.element_count,
            },
        };
        recorder.dispatch(&pass, batch_count * passes::MergeHits::PROGRAM.workgroup[0]);
        // One value more than there are counts: the total.
        scan::exclusive(recorder, &self.row_counts, batch_count as usize + 1, &self.scan);
    }

    /// Adds the rows of a merged batch to the list, in a new window where the last one has no room.
    pub fn append(&mut self, batch: Range<u32>) -> Result<(), LinkError> {
        let batch_count = batch.len() as u32;
        let total = self.context.download_range(&self.row_counts, batch.len()..batch.len() + 1)?[0];
        let link_count = u64::from(self.links.link_count) + u64::from(total);
        let after = u32::try_from(link_count).map_err(|_| LinkError::TooMany(link_count))?;
        let room = self.links.windows.last().map_or(0, |w| w.table.capacity() - w.link_count as usize);
        if self.links.windows.is_empty() || room < total as usize {
            self.open_window(&batch, total)?;
        }
        let Some(window) = self.links.windows.last_mut() else { return Ok(()) };

        let mut recorder = self.context.recorder("links")?;
        let threads = batch_count * passes::WriteRows::PROGRAM.workgroup[0];
        let row_capacity = 3 * self.ray_count;
        let (link_base, window_base) = (self.links.link_count, window.link_count);
        match &window.table {
            LinkTable::Full(links) => recorder.dispatch(
                &passes::WriteRows {
                    row_offsets: &self.row_counts,
                    row_entries: &self.row_entries,
                    links,
                    link_offsets: &self.links.offsets,
                    params: passes::WriteRowsParams {
                        first_element: batch.start,
                        batch_count,
                        row_capacity,
                        link_base,
                        window_base,
                        unit_weight: 1.0 / (RAY_UNITS * self.ray_count) as f32,
                    },
                },
                threads,
            ),
            LinkTable::Packed(packed_links) => recorder.dispatch(
                &passes::WritePackedRows {
                    row_offsets: &self.row_counts,
                    row_entries: &self.row_entries,
                    packed_links,
                    link_offsets: &self.links.offsets,
                    params: passes::WritePackedRowsParams {
                        first_element: batch.start,
                        batch_count,
                        row_capacity,
                        link_base,
                        window_base,
                        unit_divisor: RAY_UNITS * self.ray_count / PACKED_UNITS,
                    },
                },
                batch_count,
            ),
        }
        recorder.submit()?;
        window.element_count += batch_count;
        window.link_count += total;
        self.links.link_count = after;
        Ok(())
    }

    /// Makes room for the rest of the rows, judged by this batch, and in any case for the batch itself.
    fn open_window(&mut self, batch: &Range<u32>, total: u32) -> Result<(), LinkError> {
        let link_bytes = match self.links.format {
            LinkFormat::Full => size_of::<Link>() as u64,
            LinkFormat::Packed => size_of::<u32>() as u64,
        };
        let remaining = u64::from(self.element_count - batch.start);
        let expected = (u64::from(total) * remaining).div_ceil(batch.len().max(1) as u64);
        // A little more where it is a guess.
        let wanted = if batch.end == self.element_count { u64::from(total) } else { expected + expected / 64 };
        let largest = self.context.limits().storage_buffer_bytes / link_bytes;
        let available = self.budget.saturating_sub(self.links.size_bytes()).min(self.context.available_bytes());
        if expected * link_bytes > available {
            let counted = batch.end;
            return Err(LinkError::OutOfMemory {
                needed: self.links.size_bytes() + expected * link_bytes,
                available: available + self.links.size_bytes(),
                per_element: (f64::from(self.links.link_count) + f64::from(total)) / f64::from(counted),
                counted,
                element_count: self.element_count,
            });
        }
        let capacity = wanted.min(available / link_bytes).min(largest).max(u64::from(total));
        self.links.windows.push(LinkWindow {
            first_element: batch.start,
            element_count: 0,
            first_link: self.links.link_count,
            link_count: 0,
            table: LinkTable::new(self.context, self.links.format, self.links.windows.len(), capacity as usize)?,
        });
        Ok(())
    }

    /// The links of all batches appended.
    pub fn finish(self) -> Links {
        self.links
    }
}
