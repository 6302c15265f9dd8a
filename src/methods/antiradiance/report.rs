//! What the method counted, for profiles and for judging a solution.

use super::{NodeLinks, Settings, Tables, Transfers};
use crate::stages::elements::Elements;
use crate::stages::emitters::Emitters;
use crate::stages::hierarchy::Hierarchy;
use serde::Serialize;
use std::fmt;

/// Counts of the last making of links.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Report {
    pub elements: u32,
    pub leaves: u32,
    /// Leaves and inner nodes.
    pub nodes: u32,
    /// Levels below the root.
    pub depth: u32,
    pub bins: u32,
    /// Node pairs that were split.
    pub pairs: u32,
    /// Links, each of both directions counted.
    pub links: u64,
    /// What links carry, one per receiver's bin that a sender reaches.
    pub transfers: u32,
    pub transfer_windows: u32,
    /// Both tables of nodes by bins.
    pub table_bytes: u64,
    /// Transfers and their offsets.
    pub link_bytes: u64,
    pub sampled_parts: u32,
    pub linked_parts: u32,
}

impl Report {
    pub(super) fn new(
        settings: &Settings,
        elements: &Elements,
        emitters: &Emitters,
        hierarchy: &Hierarchy,
        links: &NodeLinks,
        transfers: &Transfers,
    ) -> Self {
        let (nodes, bins) = (hierarchy.node_count(), settings.bins.get());
        Self {
            elements: elements.count,
            leaves: hierarchy.leaf_count(),
            nodes,
            depth: hierarchy.plan.depth(),
            bins,
            pairs: links.counters.visited,
            links: 2 * u64::from(links.count),
            transfers: transfers.count,
            transfer_windows: transfers.windows.len() as u32,
            table_bytes: 2 * Tables::table_bytes(nodes, bins, settings.half_tables),
            link_bytes: transfers.size_bytes() + links.size_bytes(),
            sampled_parts: emitters.plan.sampled_parts,
            linked_parts: emitters.plan.linked_parts,
        }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
        write!(
            f,
            "{} leaves, {} nodes of {} bins ({:.1} MiB), {} links with {} transfers ({:.1} MiB)",
            self.leaves,
            self.nodes,
            self.bins,
            mib(self.table_bytes),
            self.links,
            self.transfers,
            mib(self.link_bytes)
        )
    }
}
