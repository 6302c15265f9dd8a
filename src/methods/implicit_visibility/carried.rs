//! What the winners of one element's bins sent in the last bounce.

use super::{Footprint, ImplicitVisibility, Transport};
use crate::gpu::{Context, GpuError};
use crate::methods::carried::{Carried, Sender};
use glam::{Quat, Vec3};
use std::f32::consts::PI;

/// Of a winner; the same constant stands in `lib/bins.glsl`.
const BACK_SEEN: u32 = 1 << 31;

impl ImplicitVisibility {
    /// By nodes, as `implicit_visibility/gather` weighs them; after a solve with bounces. Tables of glossy nodes are one
    /// entry.
    pub fn carried_to(&self, context: &Context, element: u32) -> Result<Vec<Carried>, GpuError> {
        let at = element as usize;
        let whole = context.download_range(&self.state.irradiance, at..at + 1)?[0];
        let topology = &self.trees.topology;
        let leaf = topology.leaf_elements.iter().position(|&other| other == element);
        // Thousandths of backs seen: as `elements/fill_unresolved` decides.
        let is_unresolved = context.download_range(&self.state.outcomes, at..at + 1)?[0] * 2 > 1000;
        let (Some(leaf), false) = (leaf, is_unresolved) else {
            return Ok(vec![Carried { from: Sender::Neighbours, irradiance: whole }]);
        };
        let winners = self.linking.winners_of(context, leaf as u32)?;
        let receiver = context.download_range(&self.linking.receivers, leaf..leaf + 1)?[0];
        let bin_vectors = context.download(&self.linking.bin_vectors)?;
        let surfels = context.download(&self.trees.surfels)?;
        let radiosity = context.download(&self.state.node_radiosity)?;

        let normal = Quat::from_array(receiver.frame).inverse() * receiver.normal;
        let is_paper = self.settings.transport == Transport::Disc;
        let is_bounded = self.settings.footprint() == Footprint::Single;
        let above = || bin_vectors.iter().map(|vector| vector.dot(normal).max(0.0));
        let total: f32 = above().sum();
        let scale = if is_paper || total == 0.0 { PI } else { total };
        let mut carried: Vec<Carried> = Vec::new();
        for ((mut weight, vector), winner) in above().zip(&bin_vectors).zip(winners) {
            if weight <= 0.0 || winner >= BACK_SEEN {
                continue;
            }
            if is_paper || is_bounded {
                let surfel = surfels[winner as usize];
                let offset: Vec3 = surfel.centre - receiver.origin;
                let distance = offset.length();
                let solid_angle = surfel.area * surfel.normal.dot(-offset).max(0.0) / distance.powi(3);
                weight = if is_paper {
                    solid_angle * receiver.normal.dot(offset).max(0.0) / distance
                } else {
                    weight * (solid_angle / vector.length()).min(1.0)
                };
            }
            let irradiance = weight / scale * radiosity[winner as usize];
            let leaves = topology.leaves_below(winner);
            let from = match leaves.len() as u32 {
                1 => Sender::Element(topology.leaf_elements[leaves.start as usize]),
                leaf_count => {
                    let first = topology.leaf_elements[leaves.start as usize];
                    Sender::Node { node: winner, first, leaf_count }
                }
            };
            match carried.iter_mut().find(|other| other.from == from) {
                Some(other) => other.irradiance += irradiance,
                None => carried.push(Carried { from, irradiance }),
            }
        }
        if !self.gloss.is_empty() {
            let evenly: Vec3 = carried.iter().map(|carried| carried.irradiance).sum();
            carried.push(Carried { from: Sender::Glossy, irradiance: whole - evenly });
        }
        Ok(carried)
    }
}
