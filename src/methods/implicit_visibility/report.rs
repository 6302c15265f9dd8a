//! What the method counted, for profiles and for judging a solution.

use super::{Linking, Settings};
use crate::scene::charts::Charts;
use crate::stages::elements::Elements;
use crate::stages::quadtree::Quadtrees;
use serde::Serialize;
use std::fmt;

/// Counts of the last links.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Report {
    pub elements: u32,
    pub charts: u32,
    /// Inner nodes and leaves of all trees.
    pub nodes: u32,
    /// Of each leaf.
    pub bins: u32,
    pub windows: u32,
    /// Pairs of nodes looked at.
    pub pairs_visited: u64,
    /// Of these, links proposed to bins.
    pub links_proposed: u64,
    /// Bins of elements with a winner.
    pub links_kept: u64,
    /// Elements that send their specular lobe.
    pub glossy: u32,
    /// Directions that stand for what is bright in the environment.
    pub sky_spots: u32,
    /// Bytes of all winners.
    pub winner_bytes: u64,
    /// Shadow rays to punctual lights.
    pub light_rays: u64,
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} elements, {} charts, {} nodes, {} bins each; {} pairs visited, {} links proposed, {} kept; winners {:.1} MiB",
            self.elements,
            self.charts,
            self.nodes,
            self.bins,
            self.pairs_visited,
            self.links_proposed,
            self.links_kept,
            self.winner_bytes as f64 / (1 << 20) as f64
        )
    }
}

impl Report {
    pub(super) fn new(
        settings: &Settings,
        charts: &Charts,
        elements: &Elements,
        trees: &Quadtrees,
        linking: &Linking,
    ) -> Self {
        Self {
            elements: elements.count,
            charts: charts.charts.len() as u32,
            nodes: trees.topology.node_count(),
            bins: settings.bin_count(),
            windows: linking.windows.len() as u32,
            winner_bytes: linking.windows.iter().map(|window| window.winners.size_bytes()).sum(),
            ..Self::default()
        }
    }
}
