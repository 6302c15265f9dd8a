//! What the links of elements carried in the last step: light, and negative light where antiradiance came along.

use super::tables::LocalStep;
use super::views::entry;
use super::{Antiradiance, Tables};
use crate::gpu::{Buffer, Context, GpuError};
use crate::methods::carried::{Carried, Sender};
use crate::stages::hierarchy::NONE;
use glam::Vec3;
use std::collections::{BTreeMap, HashMap};
use std::f32::consts::PI;

/// What the last step gathered from, which it replaced.
pub(super) struct Kept {
    pub exitant: Buffer<u64>,
    pub step: LocalStep,
}

impl Antiradiance {
    /// Lets steps keep what they send (for [`Self::carried_to`]), or no longer: a third table.
    pub fn keep_sent(&mut self, context: &Context, keeps: bool) -> Result<(), GpuError> {
        let exitant = || context.buffer("antiradiance/sent", self.tables.exitant.len());
        let kept = keeps.then(exitant).transpose()?;
        self.kept = kept.map(|exitant| Kept { exitant, step: LocalStep::default() });
        Ok(())
    }

    /// By sending nodes, of all bounces so far: what arrived at each of `elements` along links to its leaf and to the nodes
    /// above, as `local_irradiance` weighs it; after a solve with bounces that kept what was sent. Nothing else came:
    /// the entry [`Sender::Floor`] is what the floor below zero gave back, and rounding.
    pub fn carried_to(&self, context: &Context, elements: &[u32]) -> Result<Vec<Vec<Carried>>, GpuError> {
        let Some(kept) = &self.kept else { return Ok(vec![Vec::new(); elements.len()]) };
        let node_count = self.hierarchy.node_count() as usize;
        let (bins, words) = (&self.bins.bins, Tables::words(self.tables.half) as usize);
        let receivers: Vec<Option<Receiver>> = elements.iter().map(|&element| self.receiver(element)).collect();

        let mut cells: HashMap<u32, Vec<(u32, f32)>> = HashMap::new();
        for receiver in receivers.iter().flatten() {
            for bin in 0..bins.count() {
                cells.extend(receiver.nodes.iter().map(|node| (bin * node_count as u32 + node, Vec::new())));
            }
        }
        self.transfers.of_cells(context, &mut cells)?;
        let (sent, incident) = (context.download(&kept.exitant)?, context.download(&self.tables.incident)?);
        let (means, peaks) = (context.download(&self.tables.means)?, context.download(&self.tables.peaks)?);
        let (leaves, norms) = (context.download(&self.hierarchy.leaves)?, context.download(&self.tables.cosine_norms)?);
        let of = |table: &[u64], at: usize| entry(&table[at * words..(at + 1) * words]);

        let mut all = Vec::with_capacity(elements.len());
        for receiver in receivers {
            let Some(Receiver { leaf, nodes, is_back }) = receiver else {
                all.push(Vec::new());
                continue;
            };
            let (normal, mean) = (leaves[leaf].normal, means[2 * leaf + usize::from(is_back)]);
            let mut senders: BTreeMap<u32, Vec3> = BTreeMap::new();
            let mut floor = Vec3::ZERO;
            for (bin, direction) in bins.directions.iter().enumerate() {
                let cosine = normal.dot(*direction);
                // What travels against the normal arrives at the front.
                if (cosine > 0.0) != is_back {
                    continue;
                }
                let weight = norms[leaf] * cosine.abs().max(0.5 / (bins.count() as f32).sqrt());
                let weight = weight * 4.0 * PI / bins.count() as f32;
                let mut told = Vec3::ZERO;
                for &node in &nodes {
                    for &(from, share) in cells.get(&((bin * node_count) as u32 + node)).into_iter().flatten() {
                        let carried = share * of(&sent, from as usize);
                        *senders.entry(from % node_count as u32).or_default() += weight * carried;
                        told += carried;
                    }
                }
                // A leaf lacks what stands with its parent.
                let held = nodes.iter().take(2).map(|&node| of(&incident, bin * node_count + node as usize));
                let mut arrived: Vec3 = held.sum();
                if !kept.step.sets_floor {
                    let peak = peaks[bin * leaves.len() + leaf].max(1.0);
                    arrived = arrived.max(-kept.step.bounced * self.tables.undershoot * peak * mean);
                }
                floor += weight * (arrived - told);
            }
            let sum = senders.values().sum::<Vec3>() + floor;
            floor += sum.max(Vec3::ZERO) - sum;
            let carried = |(&node, &irradiance): (&u32, &Vec3)| Carried { from: self.sender(node), irradiance };
            let mut of_element: Vec<Carried> = senders.iter().map(carried).collect();
            of_element.push(Carried { from: Sender::Floor, irradiance: floor });
            all.push(of_element);
        }
        Ok(all)
    }

    fn receiver(&self, element: u32) -> Option<Receiver> {
        let plan = &self.hierarchy.plan;
        let leaf = *plan.leaf_of_element.get(element as usize).filter(|&&leaf| leaf != NONE)?;
        let own = &plan.leaves[leaf as usize];
        let above = |node: &u32| Some(plan.nodes[*node as usize].parent).filter(|&parent| parent != NONE);
        let nodes = std::iter::successors(Some(own.node), above).collect();
        Some(Receiver { leaf: leaf as usize, nodes, is_back: own.back_element == element })
    }

    fn sender(&self, node: u32) -> Sender {
        let plan = &self.hierarchy.plan;
        let below = &plan.nodes[node as usize..plan.nodes[node as usize].skip as usize];
        let mut leaves = below.iter().filter(|below| below.leaf != NONE);
        let first = leaves.next().map_or(0, |leaf| plan.leaves[leaf.leaf as usize].element);
        match leaves.count() as u32 {
            0 => Sender::Element(first),
            others => Sender::Node { node, first, leaf_count: others + 1 },
        }
    }
}

/// An element, as light arrives at it.
struct Receiver {
    leaf: usize,
    /// The leaf's own, its parent, and so on up.
    nodes: Vec<u32>,
    is_back: bool,
}
