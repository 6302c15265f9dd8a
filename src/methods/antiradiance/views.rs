//! Debug views: false colours per element that show what the method holds.

use super::tables::TableWindow;
use super::{Antiradiance, AntiradianceError, Settings, Tables};
use crate::gpu::{Context, GpuError};
use crate::stages::false_color::{self, NEUTRAL, PICKED};
use crate::stages::hierarchy::NONE;
use glam::Vec3;
use std::f32::consts::PI;

crate::choice! {
    /// What the picture shows.
    pub enum DebugView {
        /// Light
        Radiance = "radiance",
        /// Radiance L that leaves along the picked direction, reflected and emitted: blue none, red the most there is
        Light = "light",
        /// Antiradiance A that leaves along the picked direction
        Antiradiance = "antiradiance",
        /// L - A, what is sent on: green nothing, blue more antiradiance, red more light
        Difference = "difference",
        /// The nodes that the picked element is linked with, itself or by a node above it
        Links = "links",
        /// How much the last step changed what each element sends: blue nothing, red all of it
        Residual = "residual",
        /// The node above each element on the fourth level of the hierarchy
        Nodes = "nodes",
    }
}

impl DebugView {
    /// Whether it shows what elements send, or how that changed.
    pub(super) fn shows_tables(self) -> bool {
        matches!(self, Self::Light | Self::Antiradiance | Self::Difference | Self::Residual)
    }
}

impl Settings {
    /// The picked direction of propagation, unit.
    pub fn view_direction(&self) -> Vec3 {
        let (azimuth, elevation) = (self.view_azimuth.to_radians(), self.view_elevation.to_radians());
        Vec3::new(azimuth.cos() * elevation.cos(), elevation.sin(), azimuth.sin() * elevation.cos())
    }
}

impl Antiradiance {
    /// A colour per element for the view that the settings ask for, after a solve; `None` for light.
    pub fn view_colors(&self, context: &Context, picked: Option<u32>) -> Result<Option<Vec<Vec3>>, AntiradianceError> {
        let plan = &self.hierarchy.plan;
        let mut colors = vec![NEUTRAL; self.elements.count as usize];
        match self.settings.view {
            DebugView::Radiance => return Ok(None),
            view @ (DebugView::Light | DebugView::Antiradiance | DebugView::Difference) => {
                let sent = self.sent_along(context, self.settings.view_direction())?;
                let amount = |light: f32, anti: f32| match view {
                    DebugView::Light => light,
                    DebugView::Antiradiance => anti,
                    _ => light - anti,
                };
                let largest = sent.iter().map(|&(l, a)| amount(l, a).abs()).fold(f32::MIN_POSITIVE, f32::max);
                for (leaf, &(light, anti)) in plan.leaves.iter().zip(&sent) {
                    let share = amount(light, anti) / largest;
                    let share = if view == DebugView::Difference { 0.5 + 0.5 * share } else { share };
                    self.color_leaf(leaf.node, false_color::of_amount(share), &mut colors);
                }
            }
            DebugView::Links => {
                let leaf = picked.and_then(|element| plan.leaf_of_element.get(element as usize));
                if let Some(&leaf) = leaf.filter(|&&leaf| leaf != NONE) {
                    self.color_linked(context, leaf, &mut colors)?;
                }
            }
            DebugView::Residual => {
                let residuals = context.download(&self.tables.residuals)?;
                for (leaf, residual) in plan.leaves.iter().zip(&residuals) {
                    let share = if residual.y > 0.0 { residual.x / residual.y } else { 0.0 };
                    self.color_leaf(leaf.node, false_color::of_amount(share), &mut colors);
                }
            }
            DebugView::Nodes => {
                for leaf in &plan.leaves {
                    let mut node = leaf.node;
                    while plan.depths[node as usize] > 4 {
                        node = plan.nodes[node as usize].parent;
                    }
                    self.color_leaf(leaf.node, false_color::of_index(node), &mut colors);
                }
            }
        }
        Ok(Some(colors))
    }

    /// Per leaf: radiance L and antiradiance A along a direction, summed over channels.
    pub fn sent_along(&self, context: &Context, direction: Vec3) -> Result<Vec<(f32, f32)>, GpuError> {
        let bins = &self.bins.bins;
        let bin = bins.bin_of(direction);
        let w = bins.directions[bin as usize];
        let leaves = context.download(&self.hierarchy.leaves)?;
        let norms = context.download(&self.tables.cosine_norms)?;
        let radiosity = context.download(&self.tables.radiosity)?;
        let words = Tables::words(self.tables.half) as usize;
        let is_picked = |window: &&TableWindow| window.bins.contains(&bin);
        let Some(window) = self.tables.windows.iter().find(is_picked) else { return Ok(Vec::new()) };
        let table = context.download(&window.exitant)?;
        let plan_nodes = self.hierarchy.node_count() as usize;
        let sent = leaves.iter().zip(&norms).enumerate().map(|(index, (leaf, norm))| {
            let at = ((bin - window.bins.start) as usize * plan_nodes + leaf.node as usize) * words;
            let exitant = entry(&table[at..at + words]);
            let cosine = leaf.normal.dot(w);
            let held = norm * cosine.abs().max(0.5 / (bins.count() as f32).sqrt());
            let light = radiosity[2 * index + usize::from(cosine <= 0.0)].element_sum() / PI;
            (light, light - exitant.element_sum() / held)
        });
        Ok(sent.collect())
    }

    fn color_leaf(&self, node: u32, color: Vec3, colors: &mut [Vec3]) {
        let plan = &self.hierarchy.plan;
        for &vertex in plan.members_of(plan.nodes[node as usize].leaf) {
            colors[vertex as usize] = color;
            let back = self.elements.topology.back_elements[vertex as usize];
            if back != NONE {
                colors[back as usize] = color;
            }
        }
    }

    /// All leaves below each node that the leaf or a node above it is linked with.
    fn color_linked(&self, context: &Context, leaf: u32, colors: &mut [Vec3]) -> Result<(), GpuError> {
        let plan = &self.hierarchy.plan;
        let own = plan.leaves[leaf as usize].node;
        let is_above = |node: u32| (node..plan.nodes[node as usize].skip).contains(&own);
        let pairs = self.links.download(context)?;
        for pair in pairs {
            let other = match (is_above(pair.x), is_above(pair.y)) {
                (true, _) => pair.y,
                (_, true) => pair.x,
                _ => continue,
            };
            let below = other..plan.nodes[other as usize].skip;
            for node in below.filter(|&node| plan.nodes[node as usize].leaf != NONE) {
                self.color_leaf(node, false_color::of_index(other), colors);
            }
        }
        self.color_leaf(own, PICKED, colors);
        Ok(())
    }
}

/// An entry of a table from its words, as `table.glsl` has it.
pub(super) fn entry(words: &[u64]) -> Vec3 {
    let low = |word: u64| word as u32;
    let high = |word: u64| (word >> 32) as u32;
    match words {
        [word] => Vec3::new(half(low(*word) as u16), half((low(*word) >> 16) as u16), half(high(*word) as u16)),
        [first, second, ..] => {
            Vec3::new(f32::from_bits(low(*first)), f32::from_bits(high(*first)), f32::from_bits(low(*second)))
        }
        [] => Vec3::ZERO,
    }
}

/// An f16 by its bits.
pub fn half(bits: u16) -> f32 {
    let (exponent, fraction) = (i32::from(bits >> 10 & 0x1f), f32::from(bits & 0x3ff) / 1024.0);
    let magnitude = match exponent {
        0 => fraction * 2f32.powi(-14),
        31 => f32::INFINITY,
        _ => (1.0 + fraction) * 2f32.powi(exponent - 15),
    };
    if bits >> 15 == 0 { magnitude } else { -magnitude }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_read_as_they_were_packed() {
        assert_eq!([0x3c00, 0xc000, 0x0001, 0x7bff, 0x8000].map(half), [1.0, -2.0, 5.960_464_5e-8, 65504.0, 0.0]);
        let word = 0x3c00u64 | 0xc000 << 16 | 0x3800 << 32;
        assert_eq!(entry(&[word]), Vec3::new(1.0, -2.0, 0.5));
        let float = |x: f32| u64::from(x.to_bits());
        assert_eq!(entry(&[float(1.5) | float(-0.25) << 32, float(3.0)]), Vec3::new(1.5, -0.25, 3.0));
    }
}
