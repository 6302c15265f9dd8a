//! What the links of elements carried in the last step: light, and negative light where antiradiance came along.

use super::tables::LocalStep;
use super::views::entry;
use super::{Antiradiance, Tables};
use crate::gpu::{Buffer, Context, GpuError};
use crate::methods::carried::{Carried, Sender};
use crate::stages::elements::BACK_SIDE;
use crate::stages::hierarchy::NONE;
use glam::Vec3;
use std::collections::{BTreeMap, HashMap};
use std::f32::consts::PI;

/// What the last step gathered from, which it replaced.
pub(super) struct Kept {
    /// Window by window.
    pub exitant: Vec<Buffer<u64>>,
    pub step: LocalStep,
}

impl Antiradiance {
    /// Lets steps keep what they send (for [`Self::carried_to`]), or no longer: a third table.
    pub fn keep_sent(&mut self, context: &Context, keeps: bool) -> Result<(), GpuError> {
        let windows = self.tables.windows.iter().zip(0..);
        let exitant =
            windows.map(|(window, index)| context.buffer(&format!("antiradiance/sent {index}"), window.exitant.len()));
        let kept = keeps.then(|| exitant.collect::<Result<_, GpuError>>()).transpose()?;
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
        let takes: Vec<Vec<(Side, f32)>> = elements.iter().map(|&element| self.takes(element)).collect();
        let receivers: BTreeMap<Side, Receiver> =
            takes.iter().flatten().map(|&(side, _)| (side, self.receiver(side))).collect();

        let mut cells: HashMap<u32, Vec<(u32, f32)>> = HashMap::new();
        for receiver in receivers.values() {
            for bin in 0..bins.count() {
                cells.extend(receiver.nodes.iter().map(|node| (bin * node_count as u32 + node, Vec::new())));
            }
        }
        self.transfers.of_cells(context, &mut cells)?;
        let sent = kept.exitant.iter().map(|window| context.download(window)).collect::<Result<Vec<_>, _>>()?.concat();
        let incident = self.tables.download(context, |window| &window.incident)?;
        let (means, peaks) = (context.download(&self.tables.means)?, context.download(&self.tables.peaks)?);
        let (leaves, norms) = (context.download(&self.hierarchy.leaves)?, context.download(&self.tables.cosine_norms)?);
        let scales = context.download(&self.tables.scales)?;
        let of = |table: &[u64], at: usize| entry(&table[at * words..(at + 1) * words]);

        let mut of_sides: BTreeMap<Side, (BTreeMap<u32, Vec3>, Vec3)> = BTreeMap::new();
        for (side, Receiver { leaf, nodes, is_back }) in receivers {
            let (normal, mean) = (leaves[leaf].normal, means[2 * leaf + usize::from(is_back)]);
            let scale = if kept.step.has_environment { 1.0 } else { scales[2 * leaf + usize::from(is_back)] };
            let mut senders: BTreeMap<u32, Vec3> = BTreeMap::new();
            let mut floor = Vec3::ZERO;
            for (bin, direction) in bins.directions.iter().enumerate() {
                let cosine = normal.dot(*direction);
                // What travels against the normal arrives at the front.
                if (cosine > 0.0) != is_back {
                    continue;
                }
                let weight = norms[leaf] * cosine.abs().max(0.5 / (bins.count() as f32).sqrt());
                let weight = weight * scale * 4.0 * PI / bins.count() as f32;
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
                    let undershoot = if kept.step.cuts { 0.0 } else { kept.step.bounced * self.tables.undershoot };
                    arrived = arrived.max(-undershoot * peak * mean);
                }
                floor += weight * (arrived - told);
            }
            let sum = senders.values().sum::<Vec3>() + floor;
            floor += sum.max(Vec3::ZERO) - sum;
            of_sides.insert(side, (senders, floor));
        }
        let of_element = |takes: &Vec<(Side, f32)>| {
            let (mut senders, mut floor): (BTreeMap<u32, Vec3>, _) = (BTreeMap::new(), Vec3::ZERO);
            for (side, share) in takes {
                let (own, own_floor) = &of_sides[side];
                own.iter().for_each(|(&node, &sent)| *senders.entry(node).or_default() += *share * sent);
                floor += *share * *own_floor;
            }
            let carried = |(node, irradiance)| Carried { from: self.sender(node), irradiance };
            let floor = (!takes.is_empty()).then_some(Carried { from: Sender::Floor, irradiance: floor });
            senders.into_iter().map(carried).chain(floor).collect()
        };
        Ok(takes.iter().map(of_element).collect())
    }

    /// The leaves that an element takes light from, as `to_elements` and `take_over` do, and its shares of them.
    fn takes(&self, element: u32) -> Vec<(Side, f32)> {
        let element = self.stand_ins.of(element);
        let plan = &self.hierarchy.plan;
        let Some(&entry) = self.elements.topology.vertices.get(element as usize) else { return Vec::new() };
        let vertex = (entry & !BACK_SIDE) as usize;
        let own = plan.share_offsets[vertex] as usize..plan.share_offsets[vertex + 1] as usize;
        plan.shares[own].iter().map(|own| ((own.leaf, entry & BACK_SIDE != 0), own.share)).collect()
    }

    fn receiver(&self, (leaf, is_back): Side) -> Receiver {
        let plan = &self.hierarchy.plan;
        let above = |node: &u32| Some(plan.nodes[*node as usize].parent).filter(|&parent| parent != NONE);
        let nodes = std::iter::successors(Some(plan.leaves[leaf as usize].node), above).collect();
        Receiver { leaf: leaf as usize, nodes, is_back }
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

/// A leaf, and whether its back is meant.
type Side = (u32, bool);

/// A side of a leaf, as light arrives at it.
struct Receiver {
    leaf: usize,
    /// The leaf's own, its parent, and so on up.
    nodes: Vec<u32>,
    is_back: bool,
}
