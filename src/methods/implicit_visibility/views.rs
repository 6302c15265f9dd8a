//! Debug views: false colours per element that show how the method sees the scene.

use super::linking::ImplicitError;
use super::{ImplicitVisibility, bins};
use crate::gpu::Context;
use crate::scene::charts::NO_CHART;
use crate::stages::elements::BACK_SIDE;
use crate::stages::false_color::{self, NEUTRAL, PICKED};
use glam::{Quat, Vec3};

crate::choice! {
    /// What the picture shows.
    pub enum DebugView {
        /// Light
        Radiance = "radiance",
        /// The chart of each element
        Charts = "charts",
        /// The node above each element on the first level of the trees
        Level1 = "level-1",
        /// On the second
        Level2 = "level-2",
        /// On the third
        Level3 = "level-3",
        /// What the picked element sees, by bin; dark where it sees the back, white the element itself
        Bins = "bins",
        /// What the picked element sees, by the length of the link: blue near, red far
        LinkLengths = "link-lengths",
        /// Share of each element's hemisphere whose bins are empty: blue none, red all
        EmptyBins = "empty-bins",
        /// Share of each element's hemisphere that shows backs: red elements stand inside something
        Backs = "backs",
    }
}

impl ImplicitVisibility {
    /// Whether the settings ask for a view instead of light.
    pub fn shows_view(&self) -> bool {
        self.settings.view != DebugView::Radiance
    }

    /// A colour per element for the view that the settings ask for, after [`Self::link`].
    pub fn view_colors(&self, context: &Context, picked: Option<u32>) -> Result<Vec<Vec3>, ImplicitError> {
        let trees = &self.trees.topology;
        let mut colors = vec![NEUTRAL; self.elements.count as usize];
        match self.settings.view {
            DebugView::Radiance => {}
            DebugView::Charts => {
                for (color, &entry) in colors.iter_mut().zip(&self.elements.topology.vertices) {
                    let chart = self.charts.vertex_chart[(entry & !BACK_SIDE) as usize];
                    *color = if chart == NO_CHART { NEUTRAL } else { false_color::of_index(chart) };
                }
            }
            DebugView::Level1 => self.color_level(1, &mut colors),
            DebugView::Level2 => self.color_level(2, &mut colors),
            DebugView::Level3 => self.color_level(3, &mut colors),
            DebugView::Bins | DebugView::LinkLengths => {
                let leaf = picked.and_then(|element| trees.leaf_elements.iter().position(|&e| e == element));
                if let Some(leaf) = leaf {
                    self.color_seen(context, leaf as u32, &mut colors)?;
                    colors[trees.leaf_elements[leaf] as usize] = PICKED;
                }
            }
            DebugView::EmptyBins => self.color_empty(context, &mut colors)?,
            DebugView::Backs => {
                for (color, thousandths) in colors.iter_mut().zip(context.download(&self.state.outcomes)?) {
                    *color = false_color::of_amount(thousandths as f32 / 1000.0);
                }
            }
        }
        Ok(colors)
    }

    /// Each leaf by its ancestor on `level`, or by its root where the tree is lower.
    fn color_level(&self, level: u32, colors: &mut [Vec3]) {
        let trees = &self.trees.topology;
        for (leaf, &element) in trees.leaf_elements.iter().enumerate() {
            let node = (0..level).fold(leaf as u32, |node, _| trees.parent(node).unwrap_or(node));
            colors[element as usize] = false_color::of_index(node);
        }
    }

    /// All elements below each winner of the leaf's bins.
    fn color_seen(&self, context: &Context, leaf: u32, colors: &mut [Vec3]) -> Result<(), ImplicitError> {
        let trees = &self.trees.topology;
        let surfels = context.download(&self.trees.surfels)?;
        let origin = context.download_range(&self.linking.receivers, leaf as usize..leaf as usize + 1)?[0].origin;
        let winners = self.linking.winners_of(context, leaf)?;
        let seen = || winners.iter().enumerate().filter(|(_, winner)| **winner != u32::MAX);
        let length = |winner: u32| surfels[(winner & !BACK_SIDE) as usize].centre.distance(origin);
        let longest = seen().map(|(_, &winner)| length(winner)).fold(f32::MIN_POSITIVE, f32::max);
        for (bin, &winner) in seen() {
            let color = if self.settings.view == DebugView::Bins {
                false_color::of_index(bin as u32)
            } else {
                false_color::of_amount(length(winner) / longest)
            };
            let brightness = if winner & BACK_SIDE == 0 { 1.0 } else { 0.2 };
            for below in trees.leaves(winner & !BACK_SIDE) {
                colors[trees.leaf_elements[below as usize] as usize] = brightness * color;
            }
        }
        Ok(())
    }

    fn color_empty(&self, context: &Context, colors: &mut [Vec3]) -> Result<(), ImplicitError> {
        let vectors = bins::vectors(self.settings.bins);
        let receivers = context.download(&self.linking.receivers)?;
        for window in &self.linking.windows {
            let leaves = window.plan.leaves();
            let winners = context.download(&window.winners)?;
            for leaf in leaves.clone() {
                let receiver = &receivers[leaf as usize];
                let normal = Quat::from_array(receiver.frame).inverse() * receiver.normal;
                let (mut empty, mut all) = (0.0, 0.0);
                for (bin, vector) in vectors.iter().enumerate() {
                    let weight = vector.dot(normal).max(0.0);
                    all += weight;
                    if winners[bin * leaves.len() + (leaf - leaves.start) as usize] == u32::MAX {
                        empty += weight;
                    }
                }
                let element = self.trees.topology.leaf_elements[leaf as usize];
                colors[element as usize] = false_color::of_amount(empty / all);
            }
        }
        Ok(())
    }
}
