//! Links between nodes, refined on the device, and how evenly they receive.

use super::Settings;
use super::linking::LinkingError;
use crate::gpu::shaders::methods::antiradiance as passes;
use crate::gpu::shaders::types::PairCounters;
use crate::gpu::{Buffer, Context, GpuError};
use crate::stages::hierarchy::Hierarchy;
use crate::stages::pair_queue::{PairQueue, PairQueuePlan};
use glam::UVec2;
use std::f32::consts::PI;

/// Pairs of one step of the queue.
const QUEUE_BATCH: u32 = 8192;
/// Links a leaf that a first attempt has room for; where there are more, they are counted by it, and made again.
const FIRST_GUESS: u64 = 112;
/// Buffers that links are spread over where one may not hold them, in `refine_links.comp`.
const PARTS: usize = 4;
/// 1.0 in bits.
const ONE: u32 = 0x3f80_0000;

/// Pairs of nodes that exchange light, in no order.
pub struct NodeLinks {
    /// All but the last in use are full.
    pairs: Vec<Buffer<UVec2>>,
    pub count: u32,
    /// What the queue counted.
    pub counters: PairCounters,
}

impl NodeLinks {
    /// Refines from the root's link to itself; about `expected` links, 0 if nobody knows.     [Dachsbacher2007 3.2]
    pub fn refine(
        context: &Context,
        hierarchy: &Hierarchy,
        solid_angle: f32,
        expected: u32,
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
        let largest_part = context.limits().storage_buffer_bytes / link_bytes;
        let available = budget.min(PARTS as u64 * largest_part * link_bytes);
        let guess = match u64::from(expected) {
            0 => FIRST_GUESS * u64::from(hierarchy.leaf_count()),
            expected => expected + expected / 8,
        };
        let mut capacity = guess.max(1024).min(available / link_bytes);
        let seeds: &[UVec2] = if hierarchy.node_count() > 0 { &[UVec2::ZERO] } else { &[] };
        loop {
            let part_capacity = capacity.min(largest_part).max(1);
            let lengths =
                (0..PARTS as u64).map(|part| capacity.saturating_sub(part * part_capacity).min(part_capacity));
            let pairs = lengths
                .enumerate()
                .map(|(part, length)| context.buffer(&format!("antiradiance/links {part}"), length as usize))
                .collect::<Result<Vec<_>, _>>()?;
            let counters = queue.refine(context, "links", seeds, |recorder| {
                let pass = passes::RefineLinks {
                    node_texels: &hierarchy.node_texels,
                    taken_pairs: &queue.taken,
                    counters: &queue.counters,
                    pair_stack: &queue.stack,
                    links: &pairs[0],
                    links_1: &pairs[1],
                    links_2: &pairs[2],
                    links_3: &pairs[3],
                    params: passes::RefineLinksParams {
                        solid_angle,
                        capacity: capacity as u32,
                        part_capacity: part_capacity as u32,
                    },
                };
                recorder.dispatch_indirect(&pass, &queue.groups);
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

    /// The buffers in use, and how many links each holds.
    pub fn parts(&self) -> impl Iterator<Item = (&Buffer<UVec2>, u32)> {
        let mut left = self.count;
        let own = self.pairs.iter().map(move |pairs| {
            let count = left.min(pairs.len() as u32);
            left -= count;
            (pairs, count)
        });
        own.filter(|&(_, count)| count > 0)
    }

    pub fn download(&self, context: &Context) -> Result<Vec<UVec2>, GpuError> {
        let mut all = Vec::with_capacity(self.count as usize);
        for (pairs, count) in self.parts() {
            all.extend(context.download_range(pairs, 0..count as usize)?);
        }
        Ok(all)
    }

    pub fn size_bytes(&self) -> u64 {
        self.pairs.iter().map(Buffer::size_bytes).sum()
    }

    /// Scale of what each side of each leaf receives (`scales`, two per leaf): links of the nodes above bring light as it
    /// is at those nodes' centres; along the edges of a room that is too much, away from them too little. An even light
    /// tells how much.
    pub fn even_out(
        &self,
        context: &Context,
        hierarchy: &Hierarchy,
        settings: &Settings,
        scales: &Buffer<f32>,
    ) -> Result<(), LinkingError> {
        let mut recorder = context.recorder("links")?;
        if !settings.even_receivers {
            recorder.fill(scales, ONE);
            return Ok(recorder.submit()?);
        }
        let sides = scales.len();
        let at_leaves = context.buffer::<u32>("antiradiance/even light at leaves", sides)?;
        let excess = context.buffer::<u32>("antiradiance/excess of even light", sides)?;
        recorder.fill(&at_leaves, 0);
        recorder.fill(&excess, 0);
        for (links, link_count) in self.parts() {
            let pass = passes::EvenLight {
                links,
                node_texels: &hierarchy.node_texels,
                at_leaves: &at_leaves,
                excess: &excess,
                params: passes::EvenLightParams { link_count },
            };
            recorder.dispatch(&pass, link_count);
        }
        let pass = passes::EvenScales {
            at_leaves: &at_leaves,
            excess: &excess,
            scales,
            params: passes::EvenScalesParams { side_count: sides as u32 },
        };
        recorder.dispatch(&pass, sides);
        Ok(recorder.submit()?)
    }
}

/// Solid angle that a node of a link may have, of a bin's.
pub fn link_solid_angle(settings: &Settings) -> f32 {
    settings.refinement * 4.0 * PI / settings.bins.get() as f32
}
