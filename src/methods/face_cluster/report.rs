//! What the method counted.

use super::{Placement, Stage};
use serde::Serialize;
use std::fmt;
use std::time::Duration;

/// Of clustering and of the last solve.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Report {
    pub triangles: u32,
    pub trees: u32,
    pub instances: u32,
    /// On the host, all levels.
    pub clusters: u64,
    pub cluster_bytes: u64,
    /// Deepest tree, levels.
    pub tree_depth: u32,
    pub clustering_seconds: f64,
    pub elements: u32,
    pub leaves: u32,
    pub element_depth: u32,
    /// Passes of light: punctual, direct and each bounce.
    pub iterations: Vec<Iteration>,
    /// Leaves with their irradiance: what is kept.
    pub solution_bytes: u64,
    /// Elements with all tables that shooting needs; given back after it.
    pub working_bytes: u64,
    /// Without finding every triangle's leaf, which is the display's and grows with the model.
    pub solve_seconds: f64,
}

/// One pass of light.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Iteration {
    pub name: String,
    /// Pairs looked at.
    pub pairs: u64,
    /// Pairs that passed light on.
    pub transfers: u32,
    pub rays: u32,
    /// Elements after it.
    pub elements: u32,
    /// What all shooters sent and all leaves received, W; the difference escaped. Lights at a distance send no known power.
    pub shot: Option<[f64; 3]>,
    pub received: [f64; 3],
    /// What is left to shoot, W/m2.
    pub largest_unshot: f32,
    pub seconds: f64,
}

impl Report {
    pub(super) fn new(stage: &Stage<'_>, placement: &Placement, clustering: Duration) -> Self {
        Self {
            triangles: stage.geometry.triangle_count(),
            trees: placement.trees.len() as u32,
            instances: placement.instance_count,
            clusters: placement.trees.iter().map(|tree| tree.clusters.len() as u64).sum(),
            cluster_bytes: placement.model_bytes(),
            tree_depth: placement.trees.iter().map(|tree| tree.depth).max().unwrap_or(0),
            clustering_seconds: clustering.as_secs_f64(),
            ..Self::default()
        }
    }

    /// Pairs that passed light on, over all iterations.
    pub fn transfers(&self) -> u64 {
        self.iterations.iter().map(|i| u64::from(i.transfers)).sum()
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} clusters of {} triangles ({:.1} MB, {} levels, {:.2} s); {} elements, {} of them leaves, {} transfers, \
             {:.2} MB of solution, {:.2} s",
            self.clusters,
            self.triangles,
            self.cluster_bytes as f64 / 1e6,
            self.tree_depth,
            self.clustering_seconds,
            self.elements,
            self.leaves,
            self.transfers(),
            self.solution_bytes as f64 / 1e6,
            self.solve_seconds
        )
    }
}

impl fmt::Display for Iteration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}: {} pairs, {} transfers, {} rays, {} elements, {:.3e} W/m2 unshot, {:.2} s",
            self.name, self.pairs, self.transfers, self.rays, self.elements, self.largest_unshot, self.seconds
        )
    }
}
