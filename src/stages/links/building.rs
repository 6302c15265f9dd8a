//! Builds links: batches of hits become rows, rows become windows.

use std::ops::Range;

use glam::UVec3;

use super::{
    LinkCounts, LinkError, LinkFormat, LinkWindow, LinkWords, Links, Outcomes, PACKED_ELEMENTS, PACKED_UNITS,
    RAY_UNITS, ROW_PIECE,
};
use crate::gpu::shaders::links as passes;
use crate::gpu::shaders::types::{Hit, RowEntry};
use crate::gpu::{Buffer, Context, GpuError, Recorder};
use crate::stages::link_rows::{RowWords, Rows};
use crate::stages::scan::{self, ScanScratch};

/// Builds [`Links`] from batches of hits, in order of receivers: [`Self::merge`], submit, [`Self::append`]. What was built is
/// handed over at the end ([`Self::finish`]), or in exchange for old links whose memory is used again
/// ([`Self::swap`]).
pub struct LinkBuilder {
    counts: LinkCounts,
    budget: u64,
    /// A row of `3 * rays` for each receiver of a batch.
    row_entries: Buffer<RowEntry>,
    /// One more than a batch; counts, then offsets within the batch.
    row_counts: Buffer<u32>,
    scan: ScanScratch,
    links: Links,
    /// Not the first links: those to come may be more, by as much as surfaces move.
    is_again: bool,
}

impl LinkBuilder {
    /// Scratch bytes per receiver of a batch.
    pub fn batch_bytes(ray_count: u32) -> u64 {
        u64::from(3 * ray_count) * size_of::<RowEntry>() as u64
    }

    /// `budget`: bytes that links may take.
    pub fn new(context: &Context, format: LinkFormat, counts: LinkCounts, budget: u64) -> Result<Self, LinkError> {
        if format == LinkFormat::Packed && counts.senders > PACKED_ELEMENTS {
            return Err(LinkError::TooManyForPacked(counts.senders));
        }
        let rows = counts.batch as usize;
        Ok(Self {
            counts,
            budget,
            row_entries: context.buffer("links/row entries", rows * 3 * counts.rays as usize)?,
            row_counts: context.buffer("links/row counts", rows + 1)?,
            scan: ScanScratch::new(context, "links", rows + 1)?,
            links: Links::new(context, format, counts)?,
            is_again: false,
        })
    }

    /// Hands the links over in place of `links`, whose memory the next ones are built in.
    pub fn swap(&mut self, links: &mut Links) {
        std::mem::swap(&mut self.links, links);
        if self.links.has_room {
            self.links.empty();
        } else {
            // The next would soon need more than there is.
            self.links.clear();
        }
        self.is_again = true;
    }

    /// As [`Self::swap`], where there are no links yet.
    pub fn take(&mut self, context: &Context) -> Result<Links, GpuError> {
        let format = match &self.links.words {
            LinkWords::Full(_) => LinkFormat::Full,
            LinkWords::Packed(_) => LinkFormat::Packed,
        };
        let mut links = Links::new(context, format, self.counts)?;
        std::mem::swap(&mut self.links, &mut links);
        self.is_again = true;
        Ok(links)
    }

    /// Leaves out what was built so far; its memory stays.
    pub fn start_over(&mut self) {
        self.links.empty();
    }

    /// Leaves out what was built so far, and gives its memory back.
    pub fn clear(&mut self) {
        self.links.clear();
        self.is_again = false;
    }

    /// Turns the hits of the receivers of `batch` into rows.
    pub fn merge(
        &self,
        recorder: &mut Recorder<'_>,
        batch: Range<u32>,
        hits: &Buffer<Hit>,
        triangles: &Buffer<UVec3>,
        back_elements: &Buffer<u32>,
        outcomes: &Outcomes,
    ) {
        let Self { counts, row_entries, row_counts, scan, .. } = self;
        let batch_count = batch.len() as u32;
        let pass = passes::MergeHits {
            hits,
            triangles,
            back_elements,
            row_entries,
            row_counts,
            escaped: &outcomes.escaped,
            outcomes: &outcomes.counts,
            // As many buckets as fit in 32 KiB beside the table of 1024 rays.
            constants: passes::MergeHitsConstants {
                rays: counts.rays,
                buckets: if counts.rays > 576 { 256 } else { 1024 },
            },
            params: passes::MergeHitsParams { first_element: batch.start, batch_count, sender_count: counts.senders },
        };
        recorder.dispatch(&pass, batch_count * passes::MergeHits::PROGRAM.workgroup[0]);
        // One value more than there are counts: the total.
        scan::exclusive(recorder, row_counts, batch_count as usize + 1, scan);
    }

    /// Adds the rows of a merged batch to the list, in a new window where the last one has no room.
    pub fn append(&mut self, context: &Context, batch: Range<u32>) -> Result<(), LinkError> {
        let Self { counts, budget, row_entries, row_counts, links, is_again, .. } = self;
        let batch_count = batch.len() as u32;
        let total = context.download_range(row_counts, batch.len()..batch.len() + 1)?[0];
        let link_count = u64::from(links.link_count) + u64::from(total);
        let after = u32::try_from(link_count).map_err(|_| LinkError::TooMany(link_count))?;

        let held = links.size_bytes();
        let (link_base, row_capacity) = (links.link_count, 3 * counts.rays);
        links.has_room = *is_again;
        let capacity = |link_bytes| {
            let budget = budget.saturating_sub(held).min(context.available_bytes());
            let wanted = window_capacity(context, counts, &batch, total, link_base, link_bytes, (held, budget))?;
            Ok(if *is_again { with_room(context, wanted, link_bytes, budget) } else { wanted })
        };
        let mut recorder = context.recorder("links")?;
        match &mut links.words {
            LinkWords::Full(set) => {
                let window = set.window_for(context, batch.start, total, || capacity(size_of::<u64>() as u64))?;
                let pass = passes::WriteRows {
                    row_offsets: row_counts,
                    row_entries,
                    links: &window.words,
                    link_offsets: &links.offsets,
                    params: passes::WriteRowsParams {
                        first_element: batch.start,
                        batch_count,
                        row_capacity,
                        link_base,
                        window_base: window.link_count,
                        unit_weight: 1.0 / (RAY_UNITS * counts.rays) as f32,
                    },
                };
                recorder.dispatch(&pass, batch_count * passes::WriteRows::PROGRAM.workgroup[0]);
                window.element_count += batch_count;
                window.link_count += total;
            }
            LinkWords::Packed(set) => {
                let window = set.window_for(context, batch.start, total, || capacity(size_of::<u32>() as u64))?;
                let pass = passes::WritePackedRows {
                    row_offsets: row_counts,
                    row_entries,
                    packed_links: &window.words,
                    link_offsets: &links.offsets,
                    params: passes::WritePackedRowsParams {
                        first_element: batch.start,
                        batch_count,
                        row_capacity,
                        link_base,
                        window_base: window.link_count,
                        unit_divisor: RAY_UNITS * counts.rays / PACKED_UNITS,
                    },
                };
                recorder.dispatch(&pass, batch_count);
                window.element_count += batch_count;
                window.link_count += total;
            }
        }
        recorder.submit()?;
        links.link_count = after;
        Ok(())
    }

    /// Adds rows made elsewhere to the list.
    pub fn append_rows(&mut self, context: &Context, receivers: Range<u32>, rows: &Rows) -> Result<(), LinkError> {
        let Self { counts, budget, links, .. } = self;
        let total = rows.offsets.last().copied().unwrap_or(0);
        let link_count = u64::from(links.link_count) + u64::from(total);
        let after = u32::try_from(link_count).map_err(|_| LinkError::TooMany(link_count))?;
        let (held, link_base) = (links.size_bytes(), links.link_count);
        let capacity = |link_bytes| {
            let budget = budget.saturating_sub(held).min(context.available_bytes());
            window_capacity(context, counts, &receivers, total, link_base, link_bytes, (held, budget))
        };
        fn fill<W: bytemuck::Pod>(
            context: &Context,
            window: &mut LinkWindow<W>,
            words: &[W],
            rows: u32,
        ) -> Result<(), GpuError> {
            for (piece, first) in words.chunks(ROW_PIECE).zip((window.link_count as usize..).step_by(ROW_PIECE)) {
                let mut recorder = context.recorder("links")?;
                recorder.write(&window.words, first, piece);
                recorder.submit()?;
            }
            window.element_count += rows;
            window.link_count += words.len() as u32;
            Ok(())
        }
        let count = receivers.len() as u32;
        match (&mut links.words, &rows.words) {
            (LinkWords::Full(set), RowWords::Full(words)) => {
                let window = set.window_for(context, receivers.start, total, || capacity(size_of::<u64>() as u64))?;
                fill(context, window, words, count)?;
            }
            (LinkWords::Packed(set), RowWords::Packed(words)) => {
                let window = set.window_for(context, receivers.start, total, || capacity(size_of::<u32>() as u64))?;
                fill(context, window, words, count)?;
            }
            _ => return Err(GpuError::Refused("rows of another link format".into()).into()),
        }
        let offsets: Vec<u32> = rows.offsets.iter().map(|offset| link_base + offset).collect();
        let mut recorder = context.recorder("links")?;
        recorder.write(&links.offsets, receivers.start as usize, &offsets);
        recorder.submit()?;
        links.link_count = after;
        Ok(())
    }

    /// Those of the batches appended so far.
    pub fn links(&self) -> &Links {
        &self.links
    }

    /// The links of all batches appended.
    pub fn finish(self) -> Links {
        self.links
    }
}

/// A window that holds a quarter more than `wanted` links, as far as that is allowed.
fn with_room(context: &Context, wanted: usize, link_bytes: u64, available: u64) -> usize {
    let most = (context.limits().storage_buffer_bytes.min(available) / link_bytes) as usize;
    (wanted + wanted / 4).min(most).max(wanted)
}

/// Links that a new window should hold: for all the rest of the rows, judged by this batch, and in any case for the
/// batch itself. `memory`: bytes held by links already, bytes that may be taken.
fn window_capacity(
    context: &Context,
    counts: &LinkCounts,
    batch: &Range<u32>,
    total: u32,
    before: u32,
    link_bytes: u64,
    (held, available): (u64, u64),
) -> Result<usize, LinkError> {
    let total = u64::from(total);
    let expected = (total * u64::from(counts.receivers - batch.start)).div_ceil(batch.len().max(1) as u64);
    if expected * link_bytes > available {
        return Err(LinkError::OutOfMemory {
            needed: held + expected * link_bytes,
            available: held + available,
            per_element: (u64::from(before) + total) as f64 / f64::from(batch.end),
            counted: batch.end,
            element_count: counts.receivers,
        });
    }
    // A little more where it is a guess.
    let wanted = if batch.end == counts.receivers { total } else { expected + expected / 64 };
    let largest = context.limits().storage_buffer_bytes / link_bytes;
    Ok(wanted.min(available / link_bytes).min(largest).max(total) as usize)
}
