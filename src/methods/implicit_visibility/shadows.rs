//! The bins as shadow maps: which points on emitters each element sees, past the winners of its own bins and of the
//! emitter's.

use super::{ImplicitError, Linking, Settings};
use crate::gpu::shaders::methods::implicit_visibility as passes;
use crate::gpu::shaders::types::{Bundle, PointSeen};
use crate::gpu::{Buffer, Context, Recorder};
use crate::stages::elements::{BACK_SIDE, Elements};
use crate::stages::emitters::Emitters;
use crate::stages::quadtree::Quadtrees;
use crate::stages::world::World;
use glam::UVec3;
use std::collections::BTreeMap;

/// What the leaves of emitters see.
pub(super) struct Shadows {
    /// Per sample: its place among the 32 of its word, and places in `leaves` of what is nearest to it, by the side that is
    /// seen: front, back. In each word those of one leaf follow each other.
    slots: Buffer<UVec3>,
    leaves: Buffer<u32>,
    /// `6 n n` per leaf.
    winners: Buffer<u32>,
    /// Where the samples are, and of each word of 32 the box that ways to them end in.
    points: Buffer<PointSeen>,
    bundles: Buffer<Bundle>,
}

impl Shadows {
    /// Bytes of the tables of [`Self::new`], at most.
    pub fn bytes_needed(settings: &Settings) -> u64 {
        let leaves = 2 * u64::from(settings.emitter_samples);
        let points = u64::from(settings.emitter_samples) * (size_of::<PointSeen>() + size_of::<Bundle>()) as u64;
        leaves * 4 * (u64::from(settings.bin_count()) + 2) + points
    }

    pub fn new(
        context: &Context,
        trees: &Quadtrees,
        elements: &Elements,
        emitters: &Emitters,
        triangles: &[[u32; 3]],
        settings: &Settings,
    ) -> Result<Self, ImplicitError> {
        // Leaf of each side of a vertex.
        let vertices = &elements.topology.vertices;
        let of_leaf = |(&element, leaf): (&u32, u32)| (vertices[element as usize], leaf);
        let leaf_of: BTreeMap<u32, u32> = trees.topology.leaf_elements.iter().zip(0..).map(of_leaf).collect();
        let mut leaves: Vec<u32> = Vec::new();
        let mut slot_of = |entry: u32| -> Option<u32> {
            let leaf = *leaf_of.get(&entry)?;
            let known = leaves.iter().position(|&other| other == leaf);
            Some(known.unwrap_or_else(|| {
                leaves.push(leaf);
                leaves.len() - 1
            }) as u32)
        };
        let mut slots = Vec::with_capacity(emitters.plan.samples.len());
        for (sample, k) in emitters.plan.samples.iter().zip(0..) {
            let [p, q] = sample.barycentrics.to_array();
            let nearest = if 1.0 - p - q >= p.max(q) { 0 } else { 1 + usize::from(q > p) };
            let vertex = triangles[sample.triangle as usize][nearest];
            // A vertex of a triangle with light has a leaf; a one-sided one is not seen from behind.
            let front = slot_of(vertex).unwrap_or(0);
            slots.push(UVec3::new(k % 32, front, slot_of(vertex | BACK_SIDE).unwrap_or(front)));
        }
        slots.chunks_mut(32).for_each(|word| word.sort_by_key(|slot| slot.y));
        let bins = leaves.len() * settings.bin_count() as usize;
        Ok(Self {
            slots: context.upload("implicit/emitter slots", &slots)?,
            leaves: context.upload("implicit/emitter leaves", &leaves)?,
            winners: context.buffer("implicit/emitter winners", bins)?,
            points: context.buffer("implicit/emitter points", slots.len())?,
            bundles: context.buffer("implicit/bundles of emitter points", slots.len().div_ceil(32))?,
        })
    }

    /// Which points on sampled emitters each element sees.
    pub fn see_emitters(
        &self,
        recorder: &mut Recorder<'_>,
        world: &World,
        (trees, elements, emitters): (&Quadtrees, &Elements, &Emitters),
        linking: &Linking,
        settings: &Settings,
    ) {
        let sample_count = emitters.plan.samples.len() as u32;
        if sample_count == 0 {
            return;
        }
        recorder.fill(&emitters.visible, 0);
        let pass = passes::EmitterPoints {
            samples: &emitters.samples,
            triangles: &world.triangles,
            positions: &world.positions,
            points: &self.points,
            bundles: &self.bundles,
            params: passes::EmitterPointsParams { sample_count, ray_offset: elements.ray_offset },
        };
        recorder.dispatch(&pass, sample_count.div_ceil(32));
        let (count, bin_count) = (self.leaves.len() as u32, settings.bin_count());
        for window in &linking.windows {
            let leaves = window.plan.leaves();
            let pass = passes::EmitterBins {
                emitter_leaves: &self.leaves,
                winners: &window.winners,
                emitter_winners: &self.winners,
                params: passes::EmitterBinsParams {
                    first_leaf: leaves.start,
                    leaf_count: leaves.len() as u32,
                    bin_count,
                    count,
                },
            };
            recorder.dispatch(&pass, count * bin_count);
        }
        for window in &linking.windows {
            let leaves = window.plan.leaves();
            let pass = passes::SeeEmitters {
                winners: &window.winners,
                receivers: &linking.receivers,
                leaf_elements: &trees.leaf_elements,
                points: &self.points,
                bundles: &self.bundles,
                sample_slots: &self.slots,
                emitter_leaves: &self.leaves,
                emitter_winners: &self.winners,
                walk_texels: &trees.walk_texels,
                walk_starts: &trees.walk_starts,
                leaf_cells: &trees.leaf_cells,
                corner_texels: &trees.corner_texels,
                visible: &emitters.visible,
                constants: passes::SeeEmittersConstants { is_turned: u32::from(settings.is_turned()) },
                params: passes::SeeEmittersParams {
                    first_leaf: leaves.start,
                    leaf_count: leaves.len() as u32,
                    n: settings.bins,
                    sample_count,
                    all_leaves: trees.topology.leaf_count(),
                    ray_offset: elements.ray_offset,
                },
            };
            recorder.dispatch(&pass, leaves.len() * sample_count.div_ceil(32) as usize);
        }
    }
}
