//! Receivers in windows: runs of leaves with all nodes above them, whose bins fit the memory there is.
//!
//! A link is received by a node and pushed down to its leaves, so a window needs the bins of its leaves and of the nodes
//! above them that receive. A tree too large for a window is cut: its upper nodes receive nothing, and links that they
//! would have received are made further down. Senders are never cut.

use crate::gpu::shaders::types::WindowLevel;
use crate::stages::quadtree::topology::QuadtreeTopology;
use std::ops::Range;

/// Pairs that a window starts from, at most (unless a single receiver has more senders).
const MAX_SEEDS: usize = 1 << 20;

/// Which nodes receive in a window.
#[derive(Debug, Clone, PartialEq)]
pub struct WindowPlan {
    /// The nodes that pairs start from as receivers.
    pub receivers: Vec<u32>,
    /// One per level of the trees, leaves first, and an empty one above.
    pub levels: Vec<WindowLevel>,
}

impl WindowPlan {
    pub fn leaves(&self) -> Range<u32> {
        self.levels[0].first..self.levels[0].first + self.levels[0].count
    }

    /// Nodes of all levels.
    pub fn row_count(&self) -> u32 {
        self.levels.iter().map(|level| level.count).sum()
    }
}

/// Windows of at most `max_rows` nodes each (at least one leaf), in order of leaves.
pub fn plan(trees: &QuadtreeTopology, max_rows: u32) -> Vec<WindowPlan> {
    let mut cut = Vec::new();
    for &root in &trees.roots {
        cut_tree(trees, root, max_rows.max(1), &mut cut);
    }
    let mut windows: Vec<WindowPlan> = Vec::new();
    let (mut rows, mut receivers): (u32, Vec<u32>) = (0, Vec::new());
    for node in cut {
        let own = subtree_rows(trees, node);
        let seeds = (receivers.len() + 1) * trees.roots.len();
        if !receivers.is_empty() && (rows + own > max_rows || seeds > MAX_SEEDS) {
            windows.push(window(trees, std::mem::take(&mut receivers)));
            rows = 0;
        }
        rows += own;
        receivers.push(node);
    }
    if !receivers.is_empty() {
        windows.push(window(trees, receivers));
    }
    windows
}

/// The highest nodes whose subtrees fit.
fn cut_tree(trees: &QuadtreeTopology, node: u32, max_rows: u32, cut: &mut Vec<u32>) {
    if subtree_rows(trees, node) <= max_rows || trees.children(node).is_empty() {
        cut.push(node);
    } else {
        trees.children(node).for_each(|child| cut_tree(trees, child, max_rows, cut));
    }
}

/// Nodes of each level below and including `node`, leaves first.
fn subtree_levels(trees: &QuadtreeTopology, node: u32) -> Vec<Range<u32>> {
    let mut levels = Vec::new();
    let mut level = node..node + 1;
    while !level.is_empty() {
        let below = trees.children(level.start).start..trees.children(level.end - 1).end;
        levels.push(level);
        level = below;
    }
    levels.reverse();
    levels
}

fn subtree_rows(trees: &QuadtreeTopology, node: u32) -> u32 {
    subtree_levels(trees, node).iter().map(|level| level.len() as u32).sum()
}

fn window(trees: &QuadtreeTopology, receivers: Vec<u32>) -> WindowPlan {
    let mut ranges: Vec<Option<Range<u32>>> = vec![None; trees.levels.len() + 1];
    for &node in &receivers {
        for (level, nodes) in subtree_levels(trees, node).into_iter().enumerate() {
            let range = ranges[level].get_or_insert(nodes.start..nodes.start);
            range.end = nodes.end;
        }
    }
    let mut row = 0;
    let levels = ranges.into_iter().map(|range| {
        let range = range.unwrap_or(0..0);
        let level = WindowLevel { first: range.start, count: range.len() as u32, row };
        row += level.count;
        level
    });
    let levels = levels.collect();
    WindowPlan { receivers, levels }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_hold_every_leaf_once_and_keep_to_their_size() {
        let sizes = [700, 1, 16, 17, 3, 0, 260, 1025];
        let trees = QuadtreeTopology::of_sizes(&sizes);
        for max_rows in [1, 7, 50, 400, 1000, 100_000] {
            let windows = plan(&trees, max_rows);
            let mut next = 0;
            for window in &windows {
                assert_eq!(window.leaves().start, next);
                next = window.leaves().end;
                assert!(window.row_count() <= max_rows, "{} rows, at most {max_rows}", window.row_count());
                // Exactly the subtrees of the receivers.
                let mut nodes: Vec<u32> =
                    window.receivers.iter().flat_map(|&node| subtree_levels(&trees, node)).flatten().collect();
                nodes.sort_unstable();
                let mut held: Vec<u32> = window.levels.iter().flat_map(|l| l.first..l.first + l.count).collect();
                held.sort_unstable();
                assert_eq!(nodes, held);
            }
            assert_eq!(next, trees.leaf_count());
            assert_eq!(windows.len() == 1, max_rows >= trees.node_count());
        }
        assert!(plan(&QuadtreeTopology::of_sizes(&[]), 10).is_empty());
    }
}
